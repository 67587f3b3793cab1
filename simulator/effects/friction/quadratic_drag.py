"""Drag that grows with the square of speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class QuadraticDrag(Effect):
    """F = c v abs(v): turbulent drag, and air or oil pressed through a restriction by the moving piston."""

    id = "quadratic_drag"
    site = Site.FORCE
    sentence = "drag grows with the square of speed, as where fluid is pressed through a restriction"
    check = "vents and exhaust ports of the actuator for restrictions, and the medium around the plug"
    parameters = (Parameter("c", "N s2/m2", "drag coefficient", scale=5e3, lower=0.0, neutral=0.0),)
    passive = True

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["c"] * q.v * ca.fabs(q.v)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The curvature of the missing force over velocity that changes its sign with it."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"c": lambda r: r.v * np.abs(r.v)})]))
