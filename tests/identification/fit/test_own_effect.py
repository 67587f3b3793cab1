"""An effect that is not in the toolkit's catalogue is simulated, fitted and judged by the public interface."""

from __future__ import annotations

import functools

import pytest

from identification import Estimator, Identification, identify
from recordings import BadParameter, Recording
from simulator import BASE, CATALOGUE, Effect, Excitation, Parameter, Sensors, Site, random_valve, simulate

SEED = 2
VALUES, STROKE = random_valve(SEED)
EFFECTS = (*BASE, "hardening")
HARDENING = 0.15 * VALUES["spring.K"] / STROKE**2
"""At the end of the stroke the spring is 15 % stronger than a linear one."""


class Hardening(Effect):
    """F = k3 x^3: a spring that hardens along the stroke."""

    id = "hardening"
    site = Site.FORCE
    sentence = "the spring hardens along the stroke"
    check = "coils that touch"
    parameters = (Parameter("k3", "N/m3", "cubic stiffness", scale=1e6, lower=0.0, neutral=0.0),)

    def force(self, q, p, s, ds):
        return p["k3"] * q.x**3


OURS = CATALOGUE.extended(Hardening())


def recorded(force_noise: float = 0.0) -> Recording:
    values = VALUES | {"hardening.k3": HARDENING}
    sensors = Sensors(rate=500.0, position_noise=1e-4 * STROKE, force_noise=force_noise)
    excite = Excitation.parse("mixed:20")
    return simulate(values, excite, sensors, stroke=STROKE, effects=EFFECTS, seed=SEED, catalogue=OURS)[0]


@functools.cache
def found(force_noise: float, estimator: Estimator = "auto") -> Identification:
    return identify([recorded(force_noise)], effects=EFFECTS, catalogue=OURS, estimator=estimator, check=False)


@pytest.mark.parametrize(
    ("share", "estimator", "order", "chosen"),
    [
        (0.0, "auto", "full", "output-error"),
        (3e-4, "auto", "damped", "noise-aware"),
        (3e-4, "noise-aware", "full", "noise-aware"),
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
