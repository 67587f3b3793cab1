"""Simulate, fit, recover: random valves without a starting value, judged against what the simulator knows."""

from __future__ import annotations

import numpy as np
import pytest
from seeded_valves import QUIET, fitted, floor_ratio, scores

from identification import Crosscheck, Outcome, crosscheck, experiment, fit
from simulator import BASE, CATALOGUE, Excitation, Sensors, random_valve, simulate

SEEDS, QUICK = range(12), (0, 2, 5, 10, 11)
COURSE, LONG = "mixed:20", "mixed:40"


def within_floor(seed: int, excite: str, rate: float) -> float:
    prepared, found, _ = fitted(seed, excite, rate)
    return floor_ratio(prepared, found, QUIET * random_valve(seed)[1])


def all_scores(seeds: range, excite: str) -> np.ndarray:
    """Errors in standard deviations, (n_seeds, n_parameters)."""
    each = [scores(*fitted(seed, excite)[1:], random_valve(seed)[0]) for seed in seeds]
    return np.array([list(one.values()) for one in each])


@pytest.mark.parametrize("seed", [pytest.param(k, marks=() if k in QUICK else pytest.mark.slow) for k in SEEDS])
def test_a_random_valve_is_recovered_at_the_noise_floor(seed):
    prepared, found, known = fitted(seed, COURSE)
    assert found.outcome is Outcome.CONVERGED
    assert found.rms == pytest.approx(1.0, abs=0.05)
    assert within_floor(seed, COURSE, 500.0) == pytest.approx(1.0, abs=0.05)
    assert max(abs(z) for z in scores(found, known, random_valve(seed)[0]).values()) < 4.5
    assert set(known.status.values()) == {"identified"}
    assert prepared.causality == "force"


@pytest.mark.slow
def test_a_fit_that_gets_lost_starts_again_with_loose_paths():
    _, found, known = fitted(26, "sine:20", 250.0)  # ends at 12 times the noise, and settles there, otherwise
    assert found.outcome is Outcome.CONVERGED
    assert found.rms == pytest.approx(1.0, abs=0.05)
    assert max(abs(z) for z in scores(found, known, random_valve(26)[0]).values()) < 4.5


@pytest.mark.slow
def test_standard_deviations_say_how_far_off_the_parameters_are():
    z = all_scores(SEEDS, COURSE)
    assert z.shape == (12, 9)
    assert 0.82 < np.mean(np.abs(z) < 1.645) < 0.99
    assert 0.6 < np.std(z) < 1.3
    assert abs(np.mean(z)) < 0.3


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in (3, 10))])
def test_two_thousand_samples_at_a_hundred_hertz_are_enough(seed):
    _, found, known = fitted(seed, "mixed:20", 100.0)
    truth = random_valve(seed)[0]
    assert found.outcome is Outcome.CONVERGED
    assert within_floor(seed, "mixed:20", 100.0) == pytest.approx(1.0, abs=0.08)
    assert max(abs(z) for z in scores(found, known, truth).values()) < 4.5
    for name, share in (("spring.K", 1e-3), ("lugre.fc", 1e-3), ("mass.m", 0.01), ("lugre.sigma0", 0.02)):
        assert found.values[name] == pytest.approx(truth[name], rel=share)


def test_an_effect_that_an_imposed_motion_would_not_show_is_fitted_with_the_rest():
    """Starts come of the force that the motion took, in which a play between stem and sensor has no part."""
    values, stroke = random_valve(3)
    effects, play = tuple(e for e in CATALOGUE.ids if e in (*BASE, "backlash")), {"backlash.width": 2e-4}
    runs = [
        simulate(values | play, Excitation.parse(course), Sensors(500.0, position_noise=QUIET * stroke), stroke=stroke,
                 effects=effects, seed=i)[0]
        for i, course in enumerate(("staircase:14", "sine:14"))
    ]  # fmt: skip
    found = fit([experiment(run) for run in runs], effects=effects)
    assert found.outcome is Outcome.CONVERGED
    assert found.values["backlash.width"] == pytest.approx(2e-4, rel=0.02)
    assert found.values["mass.m"] == pytest.approx(values["mass.m"], rel=0.02)


@pytest.mark.long
def test_a_hundred_random_valves_end_at_the_noise_floor_with_honest_intervals():
    ratio = np.array([within_floor(seed, LONG, 500.0) for seed in range(100)])
    right = np.flatnonzero(ratio < 1.05)
    assert len(right) >= 97
    z = all_scores(range(100), LONG)[right]
    assert 0.86 < np.mean(np.abs(z) < 1.645) < 0.96
    assert np.all(np.abs(np.mean(z, axis=0)) < 0.4)


def checked(seed: int) -> Crosscheck:
    prepared, found, known = fitted(seed, COURSE)
    return crosscheck(found, [prepared], known)


@pytest.mark.parametrize(
    ("seeds", "n_decided"), [(QUICK, 3), pytest.param(SEEDS, 10, marks=pytest.mark.slow)], ids=["few", "all"]
)
def test_sparse_regression_agrees_on_right_fits_where_they_slide(seeds, n_decided):
    found = [checked(seed) for seed in seeds]
    assert all(check.agrees for check in found)
    assert sum(check.decides for check in found) >= n_decided
    for check in found:
        rows = {row.name: row for row in check.rows}
        assert check.decides == ("agrees with the fit" in check.sentence)
        assert check.decides != check.sentence.startswith("no cross-check")
        assert {"spring.K", "spring.F0"} <= set(rows) or not check.decides
        assert {"x", "1", "sgn v", "v"} <= set(check.kept) or not check.decides
