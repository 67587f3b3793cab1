"""The actuating force is larger or smaller than was computed."""

from __future__ import annotations

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values


class ForceGain(Effect):
    """u -> (1 + g) u: wrong diaphragm area or scale of the pressure or load cell.

    Mass, spring and friction scaled alike do the same: it shows only beside a parameter that is known, such as the
    spring constant from the data sheet.
    """

    id = "force_gain"
    site = Site.INPUT
    sentence = "the actuating force differs from the computed one by a factor: wrong area or scale"
    check = "the effective diaphragm area and the calibration of the pressure transmitter or load cell"
    parameters = (Parameter("g", "1", "excess of the true force, share of the recorded one", 0.05, -0.95, neutral=0.0),)

    def input(self, q: Quantities, p: Values, s: Values) -> Expression:
        return (1 + p["g"]) * q.u
