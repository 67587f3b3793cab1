"""A valve with an effect that is not in the toolkit's catalogue, its recording and its fit."""

from __future__ import annotations

import functools

from identification import Estimator, Identification, identify
from recordings import Recording
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
