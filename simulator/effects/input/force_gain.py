"""The actuating force is larger or smaller than was computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


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

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """What is missing as a share of the force, beside what is not known of mass and spring."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"g": lambda r: -r.u})]))
