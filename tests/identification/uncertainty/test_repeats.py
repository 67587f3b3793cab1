"""Repeats of one test: the spread between the fits to each, beside what their intervals explain."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from seeded_valves import QUIET, kept

import bristle as br
from identification import Identification, identify
from recordings import BadParameter, Recording
from simulator import Excitation, Sensors, ValveModel, random_valve, simulate

VALUES, STROKE = random_valve(2)
FREE = ("spring.K", "lugre.fc")
GIVEN = {name: value for name, value in VALUES.items() if name not in FREE}
LITTLE = 5e-4
"""Share by which friction differs from day to day: many intervals, and yet little beside the noise."""


def recorded_on(day: int, friction: float = 1.0, force_noise: float = 0.0) -> Recording:
    """The same test of the same valve on some day, with its own noise and Coulomb friction; noise of the force [N]."""
    values = VALUES | {"lugre.fc": friction * VALUES["lugre.fc"]}
    sensors = Sensors(rate=200.0, position_noise=QUIET * STROKE, force_noise=force_noise)
    made = simulate(values, Excitation.parse("staircase:5,sine:5"), sensors, stroke=STROKE, seed=day)[0]
    return replace(made, title=f"day {day}")


@pytest.fixture(scope="module")
def alike() -> Identification:
    return br.fit([recorded_on(day) for day in (1, 2, 3, 4)], given=GIVEN, crosscheck=False, repeats=True)


@pytest.fixture(scope="module")
def changing() -> Identification:
    days = (recorded_on(1), recorded_on(2, 1 + LITTLE), recorded_on(3, 1 - LITTLE))
    return br.fit(days, given=GIVEN, crosscheck=False, repeats=True)


def test_repeats_of_a_valve_that_stays_differ_as_their_intervals_say(alike):
    assert set(alike.repeats.spreads) == set(FREE)
    for spread in alike.repeats.spreads.values():
        assert spread.count == 4
        assert 0.15 < spread.ratio < 2.1  # chi-square with three degrees of freedom, one in a hundred at either end
        assert not spread.exceeds
    assert alike.repeats.sentences() == ["The repeats differ by no more than their intervals and chance explain."]


def test_friction_that_differs_from_day_to_day_shows_beside_its_interval(changing):
    spread = changing.repeats.spreads["lugre.fc"]
    assert changing.converged
    assert spread.std == pytest.approx(LITTLE * VALUES["lugre.fc"], rel=0.2)
    assert spread.std > 5 * changing.uncertainty.std["lugre.fc"]
    assert spread.exceeds
    assert not changing.repeats.spreads["spring.K"].exceeds
    (said,) = changing.repeats.sentences()
    assert "lugre.fc" in said
    assert "spring.K" not in said
    assert "not for the valve on another day" in said


def test_the_spread_is_that_of_fits_to_the_single_recordings(changing):
    fits = [
        identify([recorded_on(1)], given=GIVEN, check=False),
        identify([recorded_on(3, 1 - LITTLE)], given=GIVEN, check=False),
    ]
    both = br.fit([recorded_on(1), recorded_on(3, 1 - LITTLE)], given=GIVEN, crosscheck=False, repeats=True).repeats
    for name in FREE:
        assert both.spreads[name].std == pytest.approx(np.std([one.values[name] for one in fits], ddof=1), rel=1e-6)
        squares = [one.uncertainty.std[name] ** 2 for one in fits]
        assert both.spreads[name].explained == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-6)


def test_the_model_keeps_the_spread_and_a_fit_without_repeats_has_none(changing, tmp_path):
    changing.write(tmp_path / "model.json")
    model = ValveModel.read(tmp_path / "model.json")
    stored = json.loads((tmp_path / "model.json").read_text())["quality"]["repeats"]
    assert stored == model.quality["repeats"] == changing.repeats.as_json()
    assert stored["parameters"]["lugre.fc"]["count"] == 3
    assert [one["recording"] for one in stored["fits"]] == ["day 1", "day 2", "day 3"]
    assert {one["estimator"] for one in stored["fits"]} == {"output-error"}
    plain = br.fit(recorded_on(1), given=GIVEN, crosscheck=False)
    assert plain.repeats is None
    assert plain.model.quality["repeats"] is None


def test_the_report_and_the_table_of_a_notebook_have_a_column(changing, tmp_path):
    changing.report(tmp_path / "fit.html")
    page = (tmp_path / "fit.html").read_text(encoding="utf-8")
    assert "± repeats" in page
    assert "not for the valve on another day" in page
    assert "± repeats" in changing._repr_html_()


@pytest.mark.slow
def test_friction_that_differs_much_leaves_no_interval_but_the_spread_and_the_means():
    found = br.fit([recorded_on(1), recorded_on(2, 1.05)], given=GIVEN, crosscheck=False, repeats=True)
    spread = found.repeats.spreads["lugre.fc"]
    assert not found.converged
    assert found.model.parameters["lugre.fc"].std is None
    assert spread.std == pytest.approx(0.05 * VALUES["lugre.fc"] / np.sqrt(2), rel=0.02)
    assert spread.mean == pytest.approx(1.025 * VALUES["lugre.fc"], rel=1e-3)
    assert "No one set of values explains all recordings together." in found.repeats.sentences()[-1]


def test_a_single_fit_that_fails_is_named_and_does_not_count():
    short = recorded_on(3)
    short = replace(kept(short, np.arange(len(short)) < 40), title="aborted")
    found = br.fit([recorded_on(1), recorded_on(2), short], given=GIVEN, crosscheck=False, repeats=True)
    assert found.converged
    assert found.repeats.spreads["lugre.fc"].count == 2
    failed = found.repeats.singles[2].failed
    assert failed
    assert found.repeats.sentences()[0] == f"aborted: not counted among the repeats: {failed}"


@pytest.mark.slow
def test_a_fit_that_estimates_the_force_has_its_repeats_too():
    days = [recorded_on(day, friction, force_noise=0.5) for day, friction in ((1, 1.0), (2, 1.02))]
    found = br.fit(days, given=GIVEN, crosscheck=False, repeats=True)
    assert found.fit.estimator == "noise-aware"
    spread = found.repeats.spreads["lugre.fc"]
    assert spread.std == pytest.approx(0.02 * VALUES["lugre.fc"] / np.sqrt(2), rel=0.2)
    assert spread.exceeds


def test_without_time_nothing_counts():
    days = [recorded_on(day, force_noise=0.5) for day in (1, 2)]
    found = br.fit(days, budget=1.0, crosscheck=False, repeats=True)
    assert [one.failed for one in found.repeats.singles] == ["the time allowed was over before its fit had ended"] * 2
    assert {spread.count for spread in found.repeats.spreads.values()} == {0}


def test_what_is_identified_in_one_fit_alone_has_no_spread():
    short = recorded_on(3)
    short = replace(kept(short, np.arange(len(short)) < 40), title="aborted")
    repeats = br.fit([recorded_on(1), short], given=GIVEN, crosscheck=False, repeats=True).repeats
    assert repeats.spreads["lugre.fc"].count == 1
    assert repeats.spreads["lugre.fc"].std is None
    assert "No spread between the repeats is known" in repeats.sentences()[-1]


def test_one_recording_is_refused():
    with pytest.raises(BadParameter, match="repeats: one recording has no spread; give 2 or more"):
        identify([recorded_on(1)], repeats=True)
