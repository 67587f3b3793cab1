"""A position sensor whose zero walks away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class SensorDrift(Effect):
    """y -> y + r t, t from the recording's own clock."""

    id = "sensor_drift"
    site = Site.OUTPUT
    sentence = "the zero of the position sensor drifts during the recording"
    check = "mounting and temperature of the position sensor, and its zero before and after the recording"
    parameters = (Parameter("r", "m/s", "change of the zero per time", scale=1e-5, neutral=0.0),)

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        return q.y + p["r"] * q.t

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The drift of a force that would move the spring as much."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"r": lambda r: -base["spring.K"] * r.t})]))
