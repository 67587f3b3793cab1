"""The actuating force follows late."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, TriedAt, Values
from simulator.imitation import late
from simulator.relaxation import Lag


class ActuatorLag(Effect):
    """tau df/dt = u - f, f in place of u: volumes that fill through restrictions."""

    id = "actuator_lag"
    site = Site.INPUT
    sentence = "the actuating force lags behind the recorded one, as where a volume fills through a restriction"
    check = "tubing, restrictions and volume between the pressure transmitter and the actuator"
    parameters = (Parameter("tau", "s", "time constant", scale=0.02, lower=0.0, neutral=0.0, tried_at=TriedAt.SHARES),)
    memory = (Memory("f", "N", at_force=True),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Lag]:
        return {"f": Lag(q.u, p["tau"])}

    def input(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["f"]

    def imitated(self, base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        return late(self.parameter_name("tau"), base)
