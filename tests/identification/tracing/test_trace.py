"""Tracing: the effect that was put in is named, nothing where nothing is, and the files follow the contract."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from stiff_valves import stem_test
from traced_valves import recorded, traced, traced_imposed

from bristle.cli.app import run
from identification import identify, trace
from identification.data.experiment import experiment
from identification.tracing.models.comparison import Whiteness
from identification.tracing.models.trial_data import divided
from identification.tracing.residual import describe_residual
from recordings import Recording, write
from simulator import BASE, CATALOGUE, Catalogue, ValveModel


def test_a_complete_model_lacks_nothing():
    found = traced(None)
    assert found.verdict == "none"
    assert found.effects_added == ()
    assert found.selection.after.white
    assert not any(c.accepted for c in found.candidates)
    said = " ".join(found.sentences())
    assert re.search(r"The error called 'report' is that on [\d.]+ s of data that neither fitted nor chose", said)


ON_RECORDINGS = {
    # the mass turns by 1.04 rad a sample: starting values are too stiff, the search is not
    "full": lambda: recorded()[:3],
    "damped": lambda: stem_test(100.0, ("staircase:12", "sine:12", "sine:10")),
}


@pytest.mark.slow
@pytest.mark.parametrize("order", ON_RECORDINGS)
def test_a_trace_starts_from_what_identify_says_of_the_same_recordings(order):
    *fitted, held_out = ON_RECORDINGS[order]()
    base = trace(fitted, holdout=[held_out], catalogue=Catalogue(CATALOGUE.pick(BASE))).base
    alone = identify(fitted, check=False)
    assert base.fit.order == alone.fit.order == order
    assert base.model.values == alone.model.values
    assert base.uncertainty.status == alone.uncertainty.status


def test_what_only_held_out_recordings_show_is_said_so():
    found = traced(None)
    assert not found.selection.only_held_out
    seen = replace(found.selection, verdict="unlisted", after=Whiteness(False, 0.0, 1.3, 0.0))
    assert seen.only_held_out
    residual = describe_residual(seen)
    assert "of the held-out recordings, and does not show in the fitted ones" in residual.where
    said = replace(found, selection=seen, residual=residual).sentences()
    assert said[0] == "Something is missing, and the recordings that were fitted do not show what."


def test_where_no_name_is_given_the_answer_says_what_comes_nearest():
    found = traced("hardening_spring", k3=3e5)
    said = replace(found, selection=replace(found.selection, verdict="unlisted", added=(), same_class=())).sentences()
    assert said[0] == "Something is missing, and it is none of the effects known here."
    assert said[1].startswith("hardening_spring comes nearest (the spring stiffens along the stroke")
    assert "too much is left" in said[1]
    complete = traced(None)
    nothing = replace(complete, selection=replace(complete.selection, verdict="unlisted")).sentences()
    assert not any("comes nearest" in line for line in nothing)


@pytest.mark.slow
def test_recordings_of_an_exact_force_lack_nothing(capsys: pytest.CaptureFixture[str]):
    assert run(["trace", "bundled:step", "bundled:sine", "--holdout", "bundled:mixed"]) == 0
    assert "verdict: none" in capsys.readouterr().out


def test_sparse_regression_chooses_the_stiffening_spring_too():
    opinion = traced_imposed("hardening_spring", k3=3e6).second_opinion
    assert opinion is not None
    assert (opinion.effect, opinion.share > 0.5) == ("hardening_spring", True)


def test_a_stiffening_spring_is_named_and_measured():
    found = traced("hardening_spring", k3=3e5)
    assert found.verdict == "hardening_spring"
    assert found.model.values["hardening_spring.k3"] == pytest.approx(3e5, rel=0.05)
    before, after = (found.error[side]["holdout"]["rmse_m"] for side in ("before", "after"))
    assert after < 0.5 * before
    assert "hardening_spring" in found.model.effects


@pytest.mark.slow
def test_friction_in_several_bells_is_named_and_measured():
    """alpha(x, v) of (2.25): three weights, their place, and the speed up to which they count."""
    truth = {"a1": 0.6, "a2": -0.4, "a3": 0.8, "x0": 0.012, "w": 0.003, "u": 0.03}
    found = traced("position_speed_friction", **truth)
    assert found.effects_added == ("position_speed_friction",)
    values = {n.removeprefix("position_speed_friction."): v for n, v in found.model.values.items()}
    assert {n: values[n] for n in truth} == pytest.approx(truth, rel=0.05)


@pytest.mark.slow
def test_the_exponent_of_the_stribeck_curve_is_named_and_measured():
    values = {"stribeck_exponent.e": 0.8, "lugre.vs": 0.01}
    first, second, held, _ = recorded("stribeck_exponent", values)
    found = trace([first, second], holdout=[held])
    assert found.verdict == "stribeck_exponent"
    assert {name: found.model.values[name] for name in values} == pytest.approx(values, rel=0.05)


@pytest.mark.slow
def test_one_tight_spot_keeps_the_simpler_name():
    found = traced("position_dependent_friction", a=0.5, b=0.0, x0=0.012, w=0.003)
    assert found.effects_added == ("position_dependent_friction",)


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("actuator_lag", {"tau": 0.05}),
        ("sensor_lag", {"tau": 0.05}),
        ("actuator_hysteresis", {"h": 60.0, "r": 120.0}),
        ("actuator_hysteresis", {"h": 25.0, "r": 320.0}),
        ("nonlocal_presliding", {"f": 120.0, "d": 1.5e-3}),
        ("backlash", {"width": 5e-4}),
    ],
)
def test_what_a_base_model_imitates_is_named(effect: str, values: dict[str, float]):
    found = traced(effect, **values)
    assert found.verdict == effect
    assert found.selection.after.loss < 1.2


def test_the_files_follow_the_contract(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    found = traced("hardening_spring", k3=3e5)
    found.write(tmp_path / "trace.json")
    found.model.write(tmp_path / "model.json")
    content = json.loads((tmp_path / "trace.json").read_text())
    assert (content["format"], content["version"]) == ("valve-trace", 1)
    assert set(content) >= {
        "base", "residual", "candidates", "verdict", "effects_added", "unlisted", "error", "residual_after",
        "crosscheck", "complete", "not_tried", "seconds",
    }  # fmt: skip
    page = (Path(__file__).parents[3] / "docs" / "files.md").read_text(encoding="utf-8")
    table = page.split("### `trace.json`")[1].split("\n###")[0]
    keys = re.findall(r"^\| ([^|]*) \|", table, re.M)
    assert {key for cell in keys for key in re.findall(r"`(\w+)`", cell)} == set(content)
    assert content["complete"]
    assert content["not_tried"] == []
    assert content["effects_added"] == ["hardening_spring"]
    accepted = [c for c in content["candidates"] if c["accepted"]]
    assert [c["effect"] for c in accepted] == ["hardening_spring"]
    assert set(accepted[0]) >= {"effect", "gain", "p_value", "holdout_rmse_m", "accepted", "why"}
    assert {c["effect"] for c in content["candidates"]} <= set(CATALOGUE.ids) - set(BASE)
    assert set(content["error"]) == {"before", "after", "noise_floor_m"}
    assert set(content["error"]["after"]) == {"fit", "holdout", "report"}
    before, after = (content["error"][side]["report"]["rmse_m"] for side in ("before", "after"))
    assert after < 0.2 * before
    model = ValveModel.read(tmp_path / "model.json")
    assert model.parameters["hardening_spring.k3"].std is not None
    assert run(["show", str(tmp_path / "trace.json")]) == 0
    said = capsys.readouterr().out
    assert "verdict hardening_spring" in said
    assert "error after, report:" in said
    (tmp_path / "trace.json").write_text('{"format": "valve-trace"}')
    assert run(["show", str(tmp_path / "trace.json")]) == 2
    assert "it is no trace" in capsys.readouterr().err


def test_the_report_is_one_page_with_the_story(tmp_path: Path):
    from identification.report import write_trace_report

    write_trace_report(tmp_path / "trace.html", traced("hardening_spring", k3=3e5))
    text = (tmp_path / "trace.html").read_text()
    assert "The model lacked one effect, hardening spring" in text
    assert "hardening_spring" in text
    assert "<script src" not in text


def test_a_missing_recording_is_refused_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    target = tmp_path / "nowhere.h5"
    assert run(["trace", str(target)]) == 2
    assert "nowhere.h5" in capsys.readouterr().err


@pytest.mark.long
def test_the_command_says_what_it_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    paths = [tmp_path / f"{i}.h5" for i in range(4)]
    for path, recording in zip(paths, recorded("hardening_spring", {"hardening_spring.k3": 3e6}), strict=True):
        write(path, recording)
    out, model = tmp_path / "trace.json", tmp_path / "model.json"
    code = run(
        [
            "trace", *map(str, paths[:2]), "--holdout", str(paths[2]), "--report-on", str(paths[3]),
            "--out", str(out), "--model-out", str(model),
        ]
    )  # fmt: skip
    assert code == 0
    assert "verdict: hardening_spring" in capsys.readouterr().out
    assert json.loads(out.read_text())["verdict"] == "hardening_spring"
    assert "hardening_spring" in ValveModel.read(model).effects


def test_what_is_held_out_of_a_recording_holds_positions():
    whole = recorded()[0]
    half = np.where(np.arange(len(whole)) < len(whole) / 2, whole["position"].values, np.nan)
    signals = [replace(whole[n], values=half) if n == "position" else whole[n] for n in whole]
    seen = experiment(Recording.of(signals, source="simulated", title="half"))
    for e in (experiment(whole), seen):
        counts = [sum(int(s.seen.sum()) for one in part for s in one.segments) for part in divided([e], 0.25)]
        assert counts[1] / sum(counts) == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize(
    ("effect", "values", "added"),
    [
        (None, {}, ()),
        ("hardening_spring", {"k3": 3e6}, ("hardening_spring",)),
        pytest.param(
            "position_dependent_friction",
            {"a": 0.3, "b": 0.0, "x0": 0.01, "w": 0.003},
            ("position_dependent_friction",),
            marks=pytest.mark.long,
        ),
    ],
)
def test_an_imposed_motion_is_traced_by_its_force(
    effect: str | None, values: dict[str, float], added: tuple[str, ...]
) -> None:
    found = traced_imposed(effect, **values)
    assert found.effects_added[:1] == added
    assert found.verdict == (added[0] if added else "none")
    assert found.unit == "N"
    assert ("rmse_m" in found.error["before"]["holdout"]) is False
