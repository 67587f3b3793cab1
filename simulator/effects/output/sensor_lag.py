"""The measured position follows late."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, TriedAt, Values
from simulator.imitation import late
from simulator.relaxation import Lag


class SensorLag(Effect):
    """tau dw/dt = y - w, w in place of y: a filter in the transmitter."""

    id = "sensor_lag"
    site = Site.OUTPUT
    sentence = "the measured position lags behind the stem, as behind a filter"
    check = "the damping set in the position transmitter and filters of the data acquisition"
    parameters = (Parameter("tau", "s", "time constant", scale=0.02, lower=0.0, neutral=0.0, tried_at=TriedAt.SHARES),)
    memory = (Memory("w", "m", at_position=True),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Lag]:
        return {"w": Lag(q.y, p["tau"])}

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["w"]

    def imitated(self, base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        return late(self.parameter_name("tau"), base)
