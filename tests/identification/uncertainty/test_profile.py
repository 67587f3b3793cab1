"""Profile likelihood: what it adds to a standard deviation, and that it agrees where the cost is a parabola."""

from __future__ import annotations

import numpy as np
import pytest
from seeded_valves import QUIET, fitted
from stiff_valves import STIFF, stem_test

from identification import experiment, fit, profile, uncertainty_of
from recordings import BadInput
from simulator import Excitation, Sensors, random_valve, simulate

CHI2_90 = 2.7055


@pytest.mark.parametrize("name", ["lugre.fc", "lugre.sigma1"])
def test_it_agrees_with_the_standard_deviation_of_a_well_known_parameter(name):
    _, found, known = fitted(2, "mixed:20")
    p = profile(found, known, name)
    best = found.values[name]
    assert p.lower is not None
    assert p.upper is not None
    assert p.lower < best < p.upper
    assert (p.upper - p.lower) / 2 == pytest.approx(1.645 * known.spread[name], rel=0.2)
    assert abs((p.upper + p.lower) / 2 - best) < 0.3 * known.spread[name]
    assert p.lower - 2 * known.spread[name] < random_valve(2)[0][name] < p.upper + 2 * known.spread[name]


def test_it_is_a_curve_with_its_foot_at_the_best_value():
    _, found, known = fitted(2, "mixed:20")
    p = profile(found, known, "lugre.vs", points=3)
    at = int(np.argmin(p.rise))
    assert p.values[at] == found.values["lugre.vs"]
    assert p.rise[at] == 0.0
    assert len(p.values) == len(p.rise) == 7
    assert np.all(np.diff(p.values) > 0)
    assert np.all(np.diff(p.rise[at:]) > 0)
    assert np.all(np.diff(p.rise[: at + 1]) < 0)
    assert p.rise[0] == pytest.approx(9.0, rel=0.3)


@pytest.mark.slow
def test_a_parameter_at_its_bound_has_one_end():
    """Without viscous friction every small value looks the same: the profile ends above only."""
    values, stroke = random_valve(2)
    values["lugre.sigma2"] = 0.0
    sensors = Sensors(position_noise=QUIET * stroke)
    found = fit([experiment(simulate(values, Excitation.parse("sine:8,step:4"), sensors, stroke=stroke, seed=2)[0])])
    p = profile(found, uncertainty_of(found), "lugre.sigma2", points=3)
    assert p.lower is None
    assert p.upper is not None
    assert found.values["lugre.sigma2"] < p.upper < 1.0
    assert np.all(p.rise[p.values < found.values["lugre.sigma2"]] < CHI2_90)


def test_parameters_that_trade_off_get_no_narrow_interval():
    """Mass and viscous friction, where 50 samples a second show only that the valve starts."""
    _, found, known = fitted(7, "ramp:20", 50.0)
    assert known.spread["mass.m"] > 0.3 * found.values["mass.m"]
    p = profile(found, known, "mass.m", points=2)
    assert p.lower is None or p.upper is None or p.upper > 2 * p.lower


def test_the_force_may_be_noisy():
    """The profile of a noise-aware fit, along its smoothed paths: spring and Coulomb friction free, the rest held."""
    soft = {"lugre.sigma0": 1e5, "lugre.sigma1": 300.0}
    given = {name: value for name, value in (STIFF | soft).items() if name not in ("spring.K", "lugre.fc")}
    [short] = stem_test(250.0, ("sine:4",), values=soft)
    found = fit([experiment(short)], given=given, estimator="noise-aware")
    known = uncertainty_of(found)
    p = profile(found, known, "lugre.fc", points=4)
    assert found.estimator == "noise-aware"
    assert p.lower is not None
    assert p.upper is not None
    assert p.lower < found.values["lugre.fc"] < p.upper
    assert (p.upper - p.lower) / 2 == pytest.approx(1.645 * known.spread["lugre.fc"], rel=0.2)
    assert np.all(np.diff(p.rise[int(np.argmin(p.rise)) :]) > 0)


@pytest.mark.parametrize("name", ["lugre.qq", "mass"])
def test_what_is_no_free_parameter_is_refused(name):
    _, found, known = fitted(2, "mixed:20")
    with pytest.raises(BadInput, match="no free parameter") as refused:
        profile(found, known, name)
    assert "lugre.fc" in refused.value.remedy
