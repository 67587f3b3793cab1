"""Soft valves on which a fit can go astray, at a sampling that resolves their bristles: paths that hold a static
friction which is wrong by seven standard deviations, and free runs with a slip in the wrong place, which leave little
more than the noise.
"""

from __future__ import annotations

import pytest

from benchmarks.estimators import valve
from benchmarks.plant_sampling import GROSS
from identification import Outcome, fit, uncertainty_of

NOISE = 1e-3
"""Noise of the force, as a share of the force over the stroke."""


def wrong_claims(truth, found):
    known = uncertainty_of(found)
    told = [name for name in known.names if known.status[name] == "identified"]
    assert {"spring.K", "spring.F0", "lugre.fc"} <= {*told}
    return [name for name in told if abs(found.values[name] - truth[name]) > GROSS * known.spread[name]]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [12812, 12855])
def test_static_friction_does_not_stay_where_remembered_paths_hold_it(seed):
    truth, experiments = valve(seed, NOISE)
    found = fit(experiments)
    assert (found.outcome, found.order, found.estimator) == (Outcome.CONVERGED, "full", "noise-aware")
    assert found.values["lugre.fs"] == pytest.approx(truth["lugre.fs"], rel=3e-3)
    assert wrong_claims(truth, found) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "estimator"),
    [
        (12227, "output-error"),
        (12902, "output-error"),
        (12908, "output-error"),
        (12943, "output-error"),
        (12924, "noise-aware"),
    ],
)
def test_an_exact_force_is_fitted_with_error_in_it_only_where_no_free_runs_leave_noise(seed, estimator):
    """Plain squares of the first begin ten thousand times above the noise where the last sub-step moves slips. No free
    runs of the second come near in the first sub-step. Those of the third may end at 1.7 times the noise, with the mass
    21 standard deviations off. Those of the fourth diverge from most starts. Those of the last have a slip in the wrong
    place wherever they begin.
    """
    truth, experiments = valve(seed, 0.0)
    found = fit(experiments)
    assert (found.outcome, found.estimator) == (Outcome.CONVERGED, estimator)
    assert found.rms == pytest.approx(1.0, abs=0.02)
    assert wrong_claims(truth, found) == []


@pytest.mark.slow
def test_free_runs_remain_the_answer_where_they_are_asked_for():
    _, experiments = valve(12908, 0.0)
    found = fit(experiments, estimator="output-error")
    assert found.estimator == "output-error"
