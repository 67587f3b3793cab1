"""The second opinion: a sparse regression that knows no model finds the true valve, agrees with a right fit, and
disagrees with a wrong one in a sentence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from seeded_valves import changed, recorded

from identification import ComparedQuantity, Crosscheck, Fit, Outcome, crosscheck, experiment, fit, identify
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import Normal
from identification.estimators.output_error.descent import Minimum
from identification.estimators.output_error.problem import ResidualForm
from identification.sparse_regression.crosscheck import ALLOWED_FRICTION, ALLOWED_RATE
from identification.sparse_regression.regression import Regression, regression
from identification.sparse_regression.sliding import sliding
from recordings import Recording
from simulator import BASE, CATALOGUE, Excitation, Sensors, kernel, random_valve, simulate

NOISY = 1e-3
"""Force noise of the noisy recordings, as a share of the spring's force over the stroke."""
CASES = ((3001, 500.0, 0.0), (3004, 200.0, 0.0), (3004, 50.0, NOISY), (3007, 500.0, NOISY), (3007, 100.0, 0.0))


def slow_sine(seed: int, rate: float, force_noise: float, **extra: float) -> Recording:
    """A seeded valve on a slow sine over its stroke; extra : parameters of a further effect."""
    values, stroke = random_valve(seed)
    sensors = Sensors(rate, 2e-4 * stroke, force_noise * values["spring.K"] * stroke)
    named = {name.replace("__", "."): value for name, value in extra.items()}
    effects = tuple(e for e in CATALOGUE.ids if e in (*BASE, *(name.split(".")[0] for name in named)))
    return simulate(values | named, Excitation.parse("sine:50"), sensors, stroke=stroke, effects=effects, seed=seed)[0]


def found_in(recording: Recording) -> Regression:
    found = regression(sliding([experiment(recording)]))
    assert isinstance(found, Regression), found
    return found


def sliding_friction(truth: dict[str, float], speed: float) -> float:
    """Level of friction at a steady speed [m/s] in N."""
    excess = (truth["lugre.fs"] - truth["lugre.fc"]) * np.exp(-((speed / truth["lugre.vs"]) ** 2))
    return float(truth["lugre.fc"] + excess + truth["lugre.sigma2"] * speed)


@pytest.mark.parametrize(("seed", "rate", "force_noise"), CASES)
def test_the_recording_alone_shows_spring_preload_and_friction_either_way(seed, rate, force_noise):
    """Within the interval, and a part of what is allowed beside it."""
    truth, found = random_valve(seed)[0], found_in(slow_sine(seed, rate, force_noise))
    values = {q.name: q for q in found.quantities}
    K, F0 = values["spring.K"], values["spring.F0"]
    margin = 0.15 * ALLOWED_FRICTION * found.friction
    assert abs(K.value - truth["spring.K"]) < K.half + 0.25 * ALLOWED_RATE * truth["spring.K"]
    assert abs(F0.value - truth["spring.F0"]) < F0.half + margin
    assert K.half < 0.01 * truth["spring.K"]
    levels = [q for q in found.quantities if q.name.startswith("friction")]
    assert [q.name.split(",")[0] for q in levels] == ["friction rising", "friction falling"] * 2
    for level in levels:
        speed = 1e-3 * float(level.name.split(", ")[1].removesuffix(" mm/s"))
        assert abs(level.value - sliding_friction(truth, speed)) < level.half + margin, level.name
        assert level.half < 0.05 * level.value


def test_viscous_friction_of_its_own_either_way_shows_in_the_levels():
    recording = slow_sine(3007, 200.0, 0.0, asymmetric_viscous__b=300.0)
    found = found_in(recording)
    assert "|v|" in found.kept
    level = {q.name: q.value for q in found.quantities if q.name.startswith("friction")}
    speeds = sorted({float(name.split(", ")[1].removesuffix(" mm/s")) for name in level})
    slow, fast = (level[f"friction rising, {v:g} mm/s"] - level[f"friction falling, {v:g} mm/s"] for v in speeds)
    assert fast - slow == pytest.approx(2 * 300.0 * 1e-3 * (speeds[1] - speeds[0]), rel=0.1)


def said_to_be(**factors: float) -> Fit:
    """A fit whose values are those of the valve 3004 times factors, by symbol; nothing is fitted."""
    truth, valve = random_valve(3004)[0], kernel(BASE)
    held = {name: value * factors.get(name.split(".")[1], 1.0) for name, value in truth.items()}
    minimum = Minimum(np.empty(0), Normal(0.0, np.empty(0), np.empty((0, 0))), ResidualForm(0.0), 0, True)
    return Fit(Outcome.CONVERGED, valve, Coordinates.of(valve, held, 1.0), minimum=minimum)


@pytest.mark.parametrize(
    ("factors", "agrees"),
    [
        ({}, True), ({"K": 1.05}, False), ({"K": 0.0}, False), ({"fc": 1.1, "fs": 1.1}, False), ({"F0": 1.1}, False),
        ({"m": 2.0, "sigma1": 2.0}, True),
    ],
)  # fmt: skip
def test_a_model_that_is_right_in_sliding_agrees_and_a_wrong_one_does_not(factors, agrees):
    check = crosscheck(said_to_be(**factors), [experiment(slow_sine(3004, 200.0, 0.0))])
    assert check.decides
    assert check.agrees is agrees
    assert ("disagrees" in check.sentence) is not agrees


@pytest.mark.slow
def test_it_disagrees_with_a_fit_that_was_held_off_the_truth_however_wide_that_made_its_intervals():
    found = identify([slow_sine(3004, 200.0, 0.0)], given={"spring.K": 1.05 * random_valve(3004)[0]["spring.K"]})
    assert found.crosscheck is not None
    rows = {row.name: row for row in found.crosscheck.rows}
    assert not found.crosscheck.agrees
    assert not (rows["spring.K"].agrees and rows["spring.F0"].agrees)
    assert found.model.quality["crosscheck"] == found.crosscheck.sentence
    assert found.fit.rms > 2
    assert rows["spring.F0"].fitted_half < 1.645 * found.uncertainty.spread["spring.F0"]


@pytest.mark.long
def test_it_disagrees_where_the_area_of_the_diaphragm_changes_over_the_stroke():
    plain, stroke = recorded(3004, "sine:50", 200.0), random_valve(3004)[1]
    area = 1.0 - 0.1 * (plain["position"].values / stroke - 0.5)
    found = identify([changed(plain, force=plain["force"].values / area)])
    assert found.crosscheck is not None
    assert not found.crosscheck.agrees


@pytest.mark.long
def test_a_friction_that_differs_by_direction_alone_is_a_preload_while_it_slides():
    """What the check cannot see: the force is that of a preload, in the fit as in the regression."""
    recording = slow_sine(3004, 200.0, 0.0, asymmetric_coulomb__a=0.3)
    prepared, truth = experiment(recording), random_valve(3004)[0]
    middle = {q.name: q.value for q in found_in(recording).quantities}["spring.F0"]
    assert middle - truth["spring.F0"] == pytest.approx(0.3 * truth["lugre.fc"], rel=0.05)
    assert crosscheck(fit([prepared]), [prepared]).agrees


@pytest.mark.parametrize(
    ("recording", "said"),
    [
        (recorded(1, "presliding:20"), "too little"),
        (recorded(3000, "sine:50"), "too little"),
    ],
)
def test_too_little_sliding_is_said(recording, said):
    found = regression(sliding([experiment(recording)]))
    assert isinstance(found, str)
    assert said in found
    check = Crosscheck((), lack=found)
    assert check.sentence == f"no cross-check: {found}"
    assert not check.decides


def test_a_step_is_no_ground_for_a_cross_check():
    found = identify([recorded(2, "step:4", 200.0)])
    assert found.crosscheck is not None
    assert not found.crosscheck.decides
    assert found.crosscheck.sentence.startswith("no cross-check: the stem slides too little")


def test_it_can_be_left_out():
    found = identify([recorded(2)], check=False)
    assert found.crosscheck is None
    assert found.model.quality["crosscheck"] is None


def test_there_is_none_for_a_fit_without_values_or_of_a_sensor_that_shows_another_motion():
    prepared = experiment(recorded(2))
    nothing = fit([prepared], given={})
    refused = type(nothing)(Outcome.NO_MOTION, nothing.kernel, nothing.coordinates)
    assert crosscheck(refused, [prepared]).lack == "the fit has no values"
    play = tuple(e for e in CATALOGUE.ids if e in (*BASE, "backlash"))
    loose = replace(nothing, kernel=replace(nothing.kernel, effects=play))
    assert "backlash" in crosscheck(loose, [prepared]).sentence


def test_rows_and_sentence_tell_the_worst_difference():
    rows = (
        ComparedQuantity("spring.K", "N/m", 100.0, 0.5, 101.0, 0.5, 2.0, True),
        ComparedQuantity("spring.F0", "N", 100.0, 1.0, 150.0, 2.0, 5.0, True),
        ComparedQuantity("slope of friction", "N s/m", 0.0, 0.0, 50.0, 1.0, 5.0, False),
    )
    check = Crosscheck(rows, ("x", "v"), 0.01)
    assert [row.agrees for row in rows] == [True, False, True]
    assert [row.reach for row in rows] == [3.0, 8.0, 6.0]
    assert check.decides
    assert not check.agrees
    assert "spring.F0 is 150 ± 2 N, and by the fit 100" in check.sentence
    assert "agrees with the fit in steady sliding; it leaves 1.0 %" in Crosscheck(rows[:1], ("x",), 0.01).sentence
    assert "too wide" in Crosscheck(rows[2:], ("x",), 0.01).sentence
