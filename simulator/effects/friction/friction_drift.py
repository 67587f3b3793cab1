"""Friction that changes while one measures: wear, temperature, drying lubricant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class FrictionDrift(Effect):
    """Friction level times 1 + r t, t from the recording's own clock."""

    id = "friction_drift"
    site = Site.FORCE
    sentence = "friction drifts during the recording, as with temperature, wear or a packing that runs in"
    check = "the temperature of packing and medium, recent tightening of the gland, and lubrication"
    parameters = (Parameter("r", "1/s", "change of the friction level per time, share of it", scale=3e-3, neutral=0.0),)

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        return 1 + p["r"] * q.t

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """How what is missing against the motion grows with time."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"r": lambda r: r.friction(base) * r.t})]))
