"""The measured position follows late."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook
from simulator.imitation import late, shifted
from simulator.relaxation import Lag


class SensorLag(Effect):
    """tau dw/dt = y - w, w in place of y: a filter in the transmitter."""

    id = "sensor_lag"
    site = Site.OUTPUT
    sentence = "the measured position lags behind the stem, as behind a filter"
    check = "the damping set in the position transmitter and filters of the data acquisition"
    imitated = True
    parameters = (Parameter("tau", "s", "time constant", scale=0.02, lower=0.0, neutral=0.0),)
    memory = (Memory("w", "m", at_position=True),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Lag]:
        return {"w": Lag(q.y, p["tau"])}

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["w"]

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The lag of the force with which the loop of force over reading is closest: what it moves is read late."""
        return late(self.parameter_name("tau"), recordings, base, shifted)
