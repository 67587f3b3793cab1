"""How a table of tracing stands beside its goals, on tables that are in the repository and on rows made for it."""

from __future__ import annotations

import sys

import pytest

from benchmarks import release_goals
from recordings import BadInput


def _row(part: str, verdict: str, effects: tuple[str, ...] = (), **others: object) -> dict[str, object]:
    plain = {
        "strength": 6.0,
        "form": "same",
        "rig": False,
        "same_class": [],
        "added": [verdict],
        "reached": 6.0,
        "samples": 45_002,
    }
    return {"part": part, "verdict": verdict, "effects": list(effects)} | plain | others


def _lines(rows: list[dict[str, object]]) -> dict[str, str]:
    return {line.split(" | ")[0].removeprefix("| "): line for line in release_goals.shares(rows)}


def test_the_cases_of_every_goal_are_counted():
    rows = release_goals.rows_of(22015)
    lines = _lines(rows)
    assert "| 18 of 20 | 90 % (68 to 99) | missed |" in lines["nothing missing, a rig: `none`"]
    assert "| 5 of 5 | 100 % (48 to 100) | open |" in lines["nothing missing: `none`"]
    assert "| 1 of 50 |" in lines["a wrong name, where something is missing"]
    assert "| 1 of 25 |" in lines["a wrong name, where nothing is"]


@pytest.mark.parametrize(("hits", "of", "verdict"), [(100, 100, "met"), (19, 20, "open"), (60, 100, "missed")])
def test_a_goal_is_met_or_missed_where_the_interval_says_so(hits: int, of: int, verdict: str):
    rows = [_row("slow", "backlash" if i < hits else "none", ("backlash",)) for i in range(of)]
    assert _lines(rows)["the same at 50 and 100 Hz, strength 6"].endswith(f"| {verdict} |")


def test_the_interval_of_no_hit_is_the_one_in_closed_form():
    """Clopper and Pearson (1934): none of n is at most 1 - 0.025**(1/n) of all."""
    rows = [_row("outside", "dead_time", ("hose",)) for _ in range(10)]
    most = round(100 * (1 - 0.025 ** (1 / 10)))
    assert f"| 0 of 10 | 0 % (0 to {most}) | missed |" in _lines(rows)["outside the catalogue: `unlisted`"]


def test_a_strength_below_three_counts_for_no_share_of_names_but_for_wrong_ones():
    lines = _lines([_row("single", "dead_time", ("backlash",), strength=1.5)])
    assert "| 0 of 0 |  | not run |" in lines["one effect at strength 3 and more, 500 Hz: its name or class"]
    assert "| 1 of 1 |" in lines["a wrong name, where something is missing"]


def test_an_effect_that_leaves_too_little_counts_for_wrong_names_only():
    rows = [_row("slow", "dead_time", ("stribeck_exponent",), reached=0.1), _row("slow", "backlash", ("backlash",))]
    lines = _lines(rows)
    assert "| 1 of 1 |" in lines["the same at 50 and 100 Hz, strength 6"]
    assert "| 1 of 2 |" in lines["a wrong name, where something is missing"]
    assert "Of 2 cases with an effect at strength 3 and more 1 leave less than 2.5" in release_goals.weak(rows)


def test_misses_that_nothing_could_name_are_told():
    gains = 12.0, 59.0, 61.0, float("nan")
    rows = [_row("single", "none", ("backlash",), gain_of_truth=gain) for gain in gains]
    assert "Of 3 misses of what the catalogue has, 2 have" in release_goals.weak(rows)


def test_what_does_not_show_in_free_runs_is_told():
    errors = (1.0e-5, 1.0e-5), (1.09e-5, 1.0e-5), (1.2e-5, 1.0e-5)
    rows = [_row("outside", "none", ("hose",), before=before, true=true) for before, true in errors]
    others = [
        _row("outside", "unlisted", ("hose",)),
        _row("controls", "none"),
        _row("single", "none", ("a",), rig=True),
    ]
    assert release_goals.unseen([*rows, *others]).startswith("Of 3 answers `none` where something is missing, 2 have")


def test_costs_are_those_of_long_recordings_that_are_no_rigs():
    long = _row("controls", "none", processor=30.0, passes=500.0, peak_MB=900.0)
    lacking = _row("single", "backlash", ("backlash",), processor=45.0, passes=600.0, peak_MB=800.0)
    rows = [long, lacking, long | {"samples": 9_002, "processor": 900.0}, long | {"rig": True, "peak_MB": 5000.0}]
    lines = release_goals.costs(rows)
    assert "| processor time where something is missing, median | 1 | 40 s | 45 s | missed |" in lines
    assert "| processor time where nothing is missing, median | 1 | 24 s | 30 s | missed |" in lines
    assert "| memory of the process, most | 2 | 1000 MB | 900 MB | met |" in lines


def test_a_seed_that_was_not_run_is_refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(BadInput, match="--seed 4"):
        release_goals.rows_of(4)
    monkeypatch.setattr(sys, "argv", ["release_goals", "4"])
    with pytest.raises(SystemExit) as ended:
        release_goals.main()
    assert ended.value.code == 2
    assert "no finished cases" in capsys.readouterr().err
