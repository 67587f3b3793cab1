"""The actuating force follows late."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook
from simulator.imitation import filtered, late
from simulator.relaxation import Lag


class ActuatorLag(Effect):
    """tau df/dt = u - f, f in place of u: volumes that fill through restrictions."""

    id = "actuator_lag"
    site = Site.INPUT
    sentence = "the actuating force lags behind the recorded one, as where a volume fills through a restriction"
    check = "tubing, restrictions and volume between the pressure transmitter and the actuator"
    imitated = True
    parameters = (Parameter("tau", "s", "time constant", scale=0.02, lower=0.0, neutral=0.0),)
    memory = (Memory("f", "N", at_force=True),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Lag]:
        return {"f": Lag(q.u, p["tau"])}

    def input(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["f"]

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The lag of the force with which the loop of force over motion is closest."""
        return late(self.parameter_name("tau"), recordings, base, filtered)
