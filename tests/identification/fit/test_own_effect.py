"""An effect that is not in the toolkit's catalogue is simulated, fitted and judged by the public interface."""

from __future__ import annotations

import pytest
from own_effect import EFFECTS, HARDENING, OURS, STROKE, VALUES, found, recorded

from identification import Outcome, identify
from recordings import BadParameter


@pytest.mark.parametrize(
    ("share", "estimator", "order", "chosen"),
    [
        (0.0, "auto", "full", "output-error"),
        (3e-4, "auto", "damped", "noise-aware"),
        pytest.param(3e-4, "noise-aware", "full", "noise-aware", marks=pytest.mark.slow),
    ],
    ids=["exact force", "noisy force", "noise-aware"],
)
def test_it_is_recovered_within_its_interval_and_is_in_the_model(share, estimator, order, chosen):
    identified = found(share * VALUES["spring.K"] * STROKE, estimator)
    assert (identified.fit.order, identified.fit.estimator) == (order, chosen)
    error = identified.fit.values["hardening.k3"] - HARDENING
    assert abs(error) < 3 * identified.uncertainty.std["hardening.k3"]
    assert identified.uncertainty.std["hardening.k3"] < 0.1 * HARDENING
    assert identified.uncertainty.status["hardening.k3"] == "identified"
    assert identified.model.effects == EFFECTS
    assert identified.model.parameters["hardening.k3"].unit == "N/m3"


def test_it_can_be_held_within_its_bounds():
    with pytest.raises(BadParameter, match=r"given hardening\.k3: no valve has -1"):
        identify([recorded()], effects=EFFECTS, catalogue=OURS, given={"hardening.k3": -1.0})
    held = identify([recorded()], effects=EFFECTS, catalogue=OURS, given={"hardening.k3": HARDENING}, check=False)
    assert held.fit.values["hardening.k3"] == HARDENING
    assert "hardening.k3" not in held.uncertainty.std


def test_without_its_catalogue_it_is_unknown():
    with pytest.raises(BadParameter, match="effects hardening: there is no such effect; there are inertia"):
        identify([recorded()], effects=EFFECTS)


@pytest.mark.slow
def test_an_exact_force_on_a_model_that_lacks_it_has_not_converged():
    """No free runs come near, and what the best of them leave is not noise."""
    found = identify([recorded()], check=False)
    assert found.fit.estimator == "output-error"
    assert found.fit.outcome is Outcome.NOT_CONVERGED
    assert found.fit.rms > 1.5
    assert not found.uncertainty.std


def test_a_model_without_a_spring_is_refused_with_what_to_do():
    with pytest.raises(BadParameter, match=r"effects inertia, lugre: a fit is of .*; add spring, and hold .*K=0"):
        identify([recorded()], effects=("inertia", "lugre"))
