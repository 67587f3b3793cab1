"""A position sensor whose zero walks away."""

from __future__ import annotations

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values


class SensorDrift(Effect):
    """y -> y + r t, t from the recording's own clock."""

    id = "sensor_drift"
    site = Site.OUTPUT
    sentence = "the zero of the position sensor drifts during the recording"
    check = "mounting and temperature of the position sensor, and its zero before and after the recording"
    parameters = (Parameter("r", "m/s", "change of the zero per time", scale=1e-5, neutral=0.0),)

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        return q.y + p["r"] * q.t
