"""A constant force that is not constant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class ForceOffsetDrift(Effect):
    """F = r t, t from the recording's own clock: a load that rises slowly, or a pressure zero that walks away."""

    id = "force_offset_drift"
    site = Site.FORCE
    sentence = "a constant force drifts slowly: the load on the plug or the zero of the force measurement"
    check = "the zero of the pressure transmitter before and after the recording, and the line pressure"
    parameters = (Parameter("r", "N/s", "change of the force per time", scale=2.0, neutral=0.0),)

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["r"] * q.t

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """How what is missing grows with time."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"r": lambda r: r.t})]))
