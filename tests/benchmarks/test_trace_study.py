"""The study of `trace`: what counts as right, that it goes on where it stopped, and that it survives a failure."""

from __future__ import annotations

import importlib
import json
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import trace as study
from benchmarks import trace_ablation, trace_release
from benchmarks.machine import commit
from benchmarks.plants import cases, strengths
from benchmarks.plants.cases import Case
from benchmarks.plants.effects import OTHER, SAME
from benchmarks.plants.recordings import recordings
from benchmarks.trace_report import ABSENT
from benchmarks.trace_truth import has_truth
from identification import noise_std
from identification import trace_settings as settings
from simulator import BASE


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Experiments of two seconds, of strengths that need no search."""
    monkeypatch.setattr(cases, "SECONDS", {"staircase": 2.0, "sine": 2.0, "multisine": 2.0})
    monkeypatch.setattr(strengths, "_strength", lambda effect, valve, form, multiple: (0.01 * multiple, multiple))


def answer(
    verdict: str, *, added: tuple[str, ...] | None = None, same: tuple[str, ...] = (), candidates: tuple[Any, ...] = ()
) -> Any:
    """What a trace returns."""
    named = (verdict,) if verdict not in ABSENT else ()
    error = {"before": {"holdout": {"rmse_m": 4e-5}}, "after": {"holdout": {"rmse_m": 1e-5}}}
    return SimpleNamespace(
        verdict=verdict, effects_added=named if added is None else added, same_class=same, error=error,
        candidates=candidates, complete=True,
    )  # fmt: skip


def judgement(verdict: Any, effects: tuple[str, ...], part: str = "single") -> str:
    row = study.examine(part, Case(3, effects, 6.0), lambda fitted, holdout: verdict)
    return study.scored(row)


@pytest.mark.parametrize(
    ("verdict", "effects", "said"),
    [
        (answer("backlash"), ("backlash",), "right"),
        (answer("sensor_lag", same=("sensor_lag", "dead_time")), ("dead_time",), "right"),
        (answer("sensor_lag"), ("dead_time",), "wrong"),
        (answer("none"), ("dead_time",), "none"),
        (answer("unlisted"), ("hose",), "unlisted"),
        (answer("backlash"), ("hose",), "wrong"),
        (answer("none"), (), "right"),
        (answer("unlisted"), (), "unlisted"),
        (answer("backlash"), (), "wrong"),
        # what is added after a wrong first name does not make it right
        (answer("sensor_lag", added=("sensor_lag", "backlash")), ("backlash",), "wrong"),
    ],
)
def test_judgement_of_one_effect(verdict: Any, effects: tuple[str, ...], said: str) -> None:
    assert judgement(verdict, effects) == said


@pytest.mark.parametrize(
    ("added", "said"),
    [
        (("backlash", "friction_drift"), "right"),
        (("backlash",), "one"),
        (("backlash", "sensor_drift"), "one"),
        (("sensor_drift", "backlash"), "wrong"),
    ],
)
def test_judgement_of_pairs(added: tuple[str, ...], said: str) -> None:
    verdict = answer(added[0], added=added)
    assert judgement(verdict, ("friction_drift", "backlash"), "pairs") == said


def test_study_goes_on_where_it_stopped(tmp_path: Path) -> None:
    path, calls = tmp_path / "rows.jsonl", []

    def counting(fitted: Any, *, holdout: Any) -> Any:
        calls.append(1)
        return answer("none")

    work = [("controls", study.control(i)) for i in range(3)]
    study.study(work[:2], path, 1, counting)
    with path.open("a") as file:
        file.write('{"part": "contr')
    rows = study.study(work, path, 1, counting)
    assert len(calls) == 3
    assert [row["name"] for row in rows] == [case.name for _, case in work]
    assert [row["name"] for row in study.known_rows(path)] == [case.name for _, case in work]


@pytest.mark.long
def test_two_processes_give_the_same_rows(tmp_path: Path) -> None:
    work = [("controls", Case(3, seed=i, rate=100.0)) for i in range(2)]
    rows = study.study(work, tmp_path / "rows.jsonl", 2, _absent)
    assert [row["name"] for row in rows] == [case.name for _, case in work]
    assert {study.scored(row) for row in rows} == {"right"}


def _absent(fitted: Any, *, holdout: Any) -> Any:
    """A trace that never finds anything, by a name that another process can import."""
    assert (len(fitted), len(holdout)) == (2, 1)
    return answer("none")


@pytest.mark.parametrize("effects", [(), ("hardening_spring",)])
def test_a_plant_with_an_integrator_of_its_own_is_traced(effects: tuple[str, ...], monkeypatch: pytest.MonkeyPatch):
    """In a short form: as a rig records it, 8 s of staircase and of sine, 6 s of multisine held out."""
    monkeypatch.setattr(cases, "SECONDS", {"staircase": 8.0, "sine": 8.0, "multisine": 6.0})
    row = study.examine("single" if effects else "controls", Case(3, effects, 6.0, rate=250.0, rig=True))
    assert (row["verdict"], row["added"]) == ("".join(effects) or "none", list(effects))


@pytest.mark.slow
def test_the_truth_of_what_was_missed_gains_what_the_recordings_show(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An effect of no strength gains nothing: its own parameters are hardly better than those that were fitted."""
    monkeypatch.setattr(cases, "SECONDS", {"staircase": 8.0, "sine": 8.0, "multisine": 6.0})
    work = [("single", Case(3, ("hardening_spring",), strength)) for strength in (0.0, 3.0)]
    rows = study.study(work, tmp_path / "rows.jsonl", 1, _absent, examiner=study.examine_for_release)
    nothing, some = (row["gain_of_truth"] for row in rows)
    assert abs(nothing) < settings.MIN_GAIN
    assert some > 10 * settings.MIN_GAIN


@pytest.mark.parametrize(
    ("case", "shows"),
    [
        (Case(101, ("hardening_spring",)), True),
        (Case(101, ("hardening_spring", "friction_drift")), True),
        (Case(101, ("hardening_spring",), form="other"), False),
        (Case(101, ("hardening_spring",), rig=True), False),
        (Case(101, ("wavy_friction",)), False),
        (Case(101), False),
    ],
)
def test_only_laws_of_the_catalogue_have_a_truth_to_fit(case: Case, shows: bool) -> None:
    assert has_truth(case) is shows


def test_a_release_is_drawn_by_its_seed_and_every_kind_has_its_turn() -> None:
    work, other = (trace_release.drawn(seed, study.PAIRS) for seed in (1, 2))
    assert work == trace_release.drawn(1, study.PAIRS)
    assert not {case.valve for _, case in work} & {case.valve for _, case in other}
    assert len({(part, case.name) for part, case in work}) == len(work)
    kinds = {trace_release.kind_of(part, case) for part, case in work}
    assert {trace_release.kind_of(part, case) for part, case in work[: len(kinds)]} == kinds
    same = [case for part, case in work if part == "single" and case.form == "same"]
    assert len(same) == len(SAME) * len(trace_release.STRENGTHS) * trace_release.VALVES
    outside = {case.effects for part, case in work if part == "outside"}
    assert len(outside) >= 9
    others = [case for _, case in work if case.form == "other"]
    assert {case.effects for case in others} == {(effect,) for effect in OTHER}


def test_a_part_of_a_release_is_run_alone_and_makes_no_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr(study, "study", lambda work, *others: asked.extend(work) or [])
    monkeypatch.setattr(trace_release, "PAGE", tmp_path / "page.md")
    study.release(study.options(["--release", "--seed", "5", "--parts", "controls"]))
    assert {part for part, _ in asked} == {"controls"}
    assert sum(case.rig for _, case in asked) == trace_release.RIGS
    assert not trace_release.PAGE.exists()
    study.release(study.options(["--release", "--seed", "5"]))
    assert trace_release.PAGE.exists()


def test_a_release_stops_in_time_and_its_page_tells_the_misses(tmp_path: Path) -> None:
    work = [(part, case) for part, case in trace_release.drawn(5, study.PAIRS) if part == "controls"][:3]
    rows = study.study(work, tmp_path / "rows.jsonl", 1, lambda fitted, *, holdout: answer("unlisted"), minutes=0.0)
    assert [row["name"] for row in rows] == [work[0][1].name]
    rows[0] |= {"where_run": "day 1, a machine"}
    section = trace_release.section(5, "abc", rows, work)
    what, other = ("One of a rig", "A trace") if rows[0]["rig"] else ("A trace", "One of a rig")
    assert f"Commit abc; day 1, a machine. {what} took 0 s of processor time" in section
    assert "passes" not in section
    assert ", 7 passes (most 7) and up to " in trace_release.section(5, "abc", [rows[0] | {"passes": 7.3}], work)
    assert f"{other} took" not in section
    assert "| 1 of " in section
    assert f"- controls {work[0][1].name}: unlisted" in section
    assert "budget" not in section
    assert "240 s of the clock was over in 1 of 1" in trace_release.section(
        5, "abc", [rows[0] | {"complete": False}], work
    )
    missed = rows[0] | {"effects": ["backlash"], "gain_of_truth": 41.7}
    assert "unlisted (the truth gains 42)" in trace_release.section(5, "abc", [missed], work)
    first = trace_release.written("", 4, "## Seed 4\n\nfirst\n")
    both = trace_release.written(first, 5, section)
    again = trace_release.written(both, 4, "## Seed 4\n\nsecond\n")
    assert (again.count("## Seed 4"), again.count("## Seed 5")) == (1, 1)
    assert "second" in again
    assert "first" not in again


def test_an_ablation_varies_only_what_a_trace_read_and_goes_on(tmp_path: Path) -> None:
    calls = []

    def reading(fitted: Any, *, holdout: Any) -> Any:
        calls.append((settings.MAX_LOSS_ONE, settings.CHUNK_DISTANCE))
        return answer("none" if settings.MAX_LOSS_ONE < 2 else "backlash")

    (work,) = (case for case in trace_ablation.cases([7001], ["backlash"]) if case.rig)
    path, plain = tmp_path / "rows.jsonl", (settings.MAX_LOSS_ONE, settings.CHUNK_DISTANCE)
    rows = trace_ablation.ablation([work], np.inf, path, reading, head="abc")
    assert plain == (settings.MAX_LOSS_ONE, settings.CHUNK_DISTANCE)
    assert {row["number"] for row in rows} == {"", "MAX_LOSS_ONE", "CHUNK_DISTANCE"}
    assert len(calls) == len(rows) == 1 + 3 + 2
    assert trace_ablation.ablation([work], np.inf, path, reading, head="abc") == rows
    assert len(calls) == len(rows)
    lines = "\n".join(trace_ablation.table(rows))
    assert f"| MAX_LOSS_ONE | {plain[0]} | off | 1 | 1 | 1 | 0 | 1 |" in lines
    assert f"| CHUNK_DISTANCE | {plain[1]} | x 2 | 1 | 1 | 0 | 0 | 0 |" in lines


def test_a_failing_trace_is_an_answer() -> None:
    def failing(fitted: Any, *, holdout: Any) -> Any:
        raise RuntimeError("no luck")

    row = study.examine("single", Case(3, ("backlash",), 6.0), failing)
    assert study.scored(row) == "failed"
    assert row["why"] == "RuntimeError: no luck"
    assert json.loads(json.dumps(row))["verdict"] == "failed"


def test_true_error_is_near_the_noise() -> None:
    case = Case(3, ("sensor_lag",), 6.0)
    _, (held_out,), strengths = recordings(case)
    error = study.true_error(case, held_out, strengths)
    noise = noise_std(held_out["position"].values, 0.0, held_out.time)
    assert 0.9 * noise < error < 4 * noise


def test_every_part_has_its_cases() -> None:
    asked = study.options(["--valves", "5", "--strengths", "3,6", "--controls", "4"])
    count = {part: len(list(study.cases(part, asked))) for part in study.PARTS}
    assert count["single"] == 2 * len(SAME)
    assert count["controls"] == 4
    assert count["slow"] == len(study.SLOW) * len(SAME)
    names = [(part, case.name) for part in study.PARTS for case in study.cases(part, asked)]
    assert len({*names}) == len(names)


def test_passes_of_the_estimator_are_counted_by_their_nodes() -> None:
    by, theta = importlib.import_module("benchmarks.pass").estimator(BASE, damped=False, seconds=2.0)
    nodes: list[int] = []
    with study.nodes_of_passes(nodes):
        assert by.start(theta, steps=2) is not None
    assert by.start(theta, steps=2) is not None
    assert nodes == 3 * [len(by.grids[0].t)]


def test_what_has_to_be_known_is_given() -> None:
    seen = {}

    def noting(fitted: Any, *, holdout: Any, given: dict[str, float]) -> Any:
        seen.update(given)
        return answer("force_gain")

    assert study.scored(study.examine("single", Case(3, ("force_gain",), 6.0), noting)) == "right"
    assert {*seen} == {"mass.m", "spring.K", "spring.F0"}


def test_unknown_ids_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        study.options(["--ids", "backlsh"])
    assert "there is no backlsh" in capsys.readouterr().err


def test_report_counts_names_and_errors(capsys: pytest.CaptureFixture[str]) -> None:
    verdicts = [answer("backlash"), answer("sensor_lag", same=("backlash",)), answer("none"), answer("dead_time")]
    rows = [study.examine("single", Case(3, ("backlash",), 6.0, seed=i), lambda f, holdout, v=v: v)
            for i, v in enumerate(verdicts)]  # fmt: skip
    study.report(rows)
    shown = capsys.readouterr().out
    assert "right 2 (50.0 %)" in shown
    assert "wrong: backlash-v3-s6-same-3 -> dead_time" in shown
    ratio = np.median([1e-5 / row["true"] for row in rows])
    assert f"single, after: {ratio:.2f}" in shown


def test_report_says_what_chance_gains_where_nothing_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    def tried(gain: float, held: float, p: float) -> Any:
        return SimpleNamespace(effect="backlash", gain=gain, held_out=SimpleNamespace(gain=held, p_value=p))

    only_scored = SimpleNamespace(effect="dead_time", gain=400.0, held_out=None)
    verdicts = [answer("none", candidates=(only_scored, tried(3.0, -2.0, 0.5), tried(8.0, 1.0, 0.01))), answer("none"),
                answer("none", candidates=(tried(17.0, 9.0, 0.001),))]  # fmt: skip
    study.report([study.examine("controls", Case(3, seed=i), lambda f, holdout, v=v: v)
                  for i, v in enumerate(verdicts)])  # fmt: skip
    shown = capsys.readouterr().out
    assert "refitted in 2 of 3 sets" in shown
    assert "fitted gain: 12.5, 16.1, 17.0" in shown
    assert "held-out gain: 5.0, 8.2, 9.0" in shown
    assert "-log10 p: 2.5, 2.9, 3.0" in shown


def test_what_measuring_itself_writes_is_no_change_of_the_tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("method.py", "page.md"):
        (tmp_path / name).write_text("first\n")
    author = ("-c", "user.name=test", "-c", "user.email=test@localhost")
    for words in (("init", "-q"), ("add", "."), (*author, "commit", "-q", "-m", "first")):
        subprocess.run(["git", *words], check=True)
    first = commit()
    (tmp_path / "page.md").write_text("second\n")
    assert commit() == f"{first} with changes"
    assert commit(left_out=["page.md"]) == commit(["method.py"]) == first
    subprocess.run(["git", *author, "commit", "-qam", "the page"], check=True)
    assert commit() != first
    assert commit(left_out=["page.md"]) == commit(["method.py"]) == first
    (tmp_path / "method.py").write_text("second\n")
    assert commit(left_out=["page.md"]).endswith("with changes")
