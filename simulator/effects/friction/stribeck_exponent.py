"""A Stribeck curve with an exponent of its own (equation 2.5 and 2.17)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from recordings import Array
from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing

REFERENCE = 5e-3
"""Velocity [m/s] at which the exponent leaves the Stribeck curve as it is."""
NEAR_REST = 1e-6
"""Velocity [m/s] below which the power of the velocity is that at this velocity: its slope at rest stays finite."""


class StribeckExponent(Effect):
    """g = fc + (fs - fc) exp(-(v/vs)^2 (abs(v)/v0)^(e - 2)): exp(-(v/ve)^e) with ve^e = vs^2 v0^(e - 2), v0 = 5 mm/s.

    e = 2 is (2.17) and e = 1 the exponential (2.5). The curve is read at a velocity that is bent accordingly, so that
    it works on every effect that reads a level, and on a late velocity where there is frictional memory.
    """

    id = "stribeck_exponent"
    site = Site.FORCE
    sentence = (
        "friction falls with speed sooner and more gradually, or later and more suddenly, than the standard curve"
    )
    check = "the lubricant and the finish of stem and packing; move slowly at several speeds to see the curve itself"
    parameters = (Parameter("e", "1", "exponent of the Stribeck curve", scale=1.0, lower=0.2, upper=8.0, neutral=2.0),)

    def friction_speed(self, q: Quantities, p: Values, s: Values) -> Expression:
        return q.speed * ((q.speed**2 + NEAR_REST**2) / REFERENCE**2) ** ((p["e"] - 2) / 4)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The shape of the fall of friction over speed, to first order."""
        guess = Missing.of(recordings, base).best([({}, {"e": lambda r: _per_exponent(r, base)})])
        return [] if guess is None else [self.named(e=min(max(2.0 + guess.values["e"], 0.5), 4.0))]


def _per_exponent(look: FirstLook, base: Mapping[str, float]) -> Array:
    """What an exponent higher by one adds to friction [N], to first order at 2."""
    steep = (look.v / base["lugre.vs"]) ** 2
    bend = np.log(np.maximum(np.abs(look.v), NEAR_REST) / REFERENCE)
    return np.asarray(-np.sign(look.v) * (base["lugre.fs"] - base["lugre.fc"]) * steep * bend * look.falling(base))
