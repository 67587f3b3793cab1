"""Stiff valves on which a fit can go astray: a Stribeck curve that ends at 1.5 mm/s, chunks that a static friction 5 %
too low explains as well, slips whose paths miss them even at the true parameters, slips of two samples behind a
positioner, a force that answers them by less than its noise, starting values that take the bristles for a hundred times
as soft, overdamped bristles that explain all but as much, and a mass to which no descent comes back, for its paths were
chosen at another one.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import pytest

from benchmarks.plant_sampling import GROSS, behind_a_positioner, recordings
from identification import Outcome, fit, uncertainty_of
from identification.estimators.estimate import ROUGH_OUTLIERS, converged
from identification.estimators.order import slip, slip_is_over, slip_is_seen, swing_is_over

MAKE = {"stem": recordings, "loop": behind_a_positioner}
CASES = [
    ("stem", 9501, 100.0), ("stem", 9508, 50.0), ("stem", 9709, 200.0), ("stem", 9905, 100.0), ("loop", 9128, 50.0),
    ("loop", 9130, 50.0), ("stem", 10314, 200.0), ("stem", 10302, 50.0), ("stem", 11200, 200.0),
]  # fmt: skip
"""Kind, seed of the valve and rate [Hz]."""


@functools.cache
def fitted(kind, seed, rate):
    truth, experiments = MAKE[kind](seed, rate)
    return truth, fit(experiments)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed", "rate"), CASES)
def test_they_converge_to_the_valve_and_claim_nothing_wrong(kind, seed, rate):
    truth, found = fitted(kind, seed, rate)
    assert found.outcome is Outcome.CONVERGED
    assert found.order == "damped"
    for name, share in (("spring.K", 1e-3), ("lugre.fs", 0.01), ("lugre.fc", 0.03)):
        assert found.values[name] == pytest.approx(truth[name], rel=share)
    known = uncertainty_of(found)
    told = [name for name in known.names if known.status[name] == "identified"]
    assert {"spring.K", "spring.F0", "lugre.fs"} <= {*told}
    assert all(abs(found.values[name] - truth[name]) < GROSS * known.spread[name] for name in told)


@pytest.mark.slow
def test_an_outlier_or_two_more_by_chance_are_no_failure():
    """Of 6,500 innovations .1 % may lie far off: ten are no failure, twenty are one."""
    _, found = fitted("stem", 9508, 50.0)
    assert found.outcome is Outcome.CONVERGED
    assert found.estimate is not None
    few, many = (replace(found.estimate, outliers=n / found.estimate.samples) for n in (10, 20))
    assert few.outliers > ROUGH_OUTLIERS
    assert converged(few, resolved=False)
    assert not converged(many, resolved=False)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [10603, 10701, 11205, 11305])
def test_a_force_that_answers_the_motion_is_not_taken_for_friction(seed):
    """Smoothed over its answers, it had fc or sigma2 of these valves wrong by 4 to 15 standard deviations."""
    truth, found = fitted("loop", seed, 100.0)
    assert found.outcome is Outcome.CONVERGED
    known = uncertainty_of(found)
    told = [name for name in known.names if known.status[name] == "identified"]
    assert "lugre.fc" in told
    assert all(abs(found.values[name] - truth[name]) < GROSS * known.spread[name] for name in told)


def test_a_slip_is_over_after_half_a_swing_on_the_spring():
    values = {"spring.K": 40e3, "mass.m": 4.0}
    assert slip(values) == pytest.approx(100.0)
    assert not slip_is_over(values, 0.0314)
    assert slip_is_over(values, 0.0315)
    assert not slip_is_seen(values, 0.0315)
    assert not swing_is_over(values, 0.0628)
    assert swing_is_over(values, 0.0629)


def rounded(e, k):
    """An experiment whose force is k roundings larger."""
    return e.with_segments(tuple(replace(s, u=s.u * (1 + k * 1e-14)) for s in e.segments))


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "estimator"), [(12004, "output-error"), (12110, "noise-aware")])
def test_where_samples_show_only_where_slips_ended_one_of_two_ways_converges(seed, estimator):
    """Runs that began with the bristle out of balance missed a third of the samples at the true parameters. Paths about
    a slip may end in several places, so rounding decides whether a fit converges: one of three has to.
    """
    truth, experiments = MAKE["stem"](seed, 20.0)
    fits = (fit([rounded(e, k) for e in experiments]) for k in range(3))
    found = next(one for one in fits if one.outcome is Outcome.CONVERGED)
    assert found.estimator == estimator
    for name, share in (("spring.K", 3e-3), ("spring.F0", 5e-3), ("lugre.fs", 0.01)):
        assert found.values[name] == pytest.approx(truth[name], rel=share)
    known = uncertainty_of(found)
    told = [name for name in known.names if known.status[name] == "identified"]
    assert {"spring.K", "spring.F0", "lugre.fs"} <= {*told}
    assert all(abs(found.values[name] - truth[name]) < GROSS * known.spread[name] for name in told)


@pytest.mark.slow
def test_where_a_slip_is_over_before_the_next_sample_coulomb_friction_is_unresolved():
    """Runs in windows have it wrong by 12 %, with an interval of 1 %: it trades with viscous friction."""
    _, found = fitted("stem", 9708, 20.0)
    assert slip_is_over(found.values, 0.05)
    known = uncertainty_of(found)
    assert known.status["lugre.fc"] == "unresolved"
    assert "too quick for 20 samples a second" in known.note["lugre.fc"]
    assert known.status["lugre.fs"] == "identified"


@pytest.mark.slow
def test_a_force_noise_of_a_fiftieth_of_a_percent_of_friction_is_not_neglected():
    """Taken for exact it had the spring eight standard deviations off, after five times the time."""
    truth, found = fitted("stem", 11604, 200.0)
    assert found.outcome is Outcome.CONVERGED
    assert found.estimate is not None
    known = uncertainty_of(found)
    told = [name for name in known.names if known.status[name] == "identified"]
    assert {"spring.K", "lugre.fc", "lugre.fs"} <= {*told}
    assert all(abs(found.values[name] - truth[name]) < GROSS * known.spread[name] for name in told)
