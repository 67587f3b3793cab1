"""Viscous friction that differs by direction (equation 2.4, b_i)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class AsymmetricViscous(Effect):
    """F = b abs(v): with sigma2 v the coefficients b1 = sigma2 + b and b2 = sigma2 - b of (2.4)."""

    id = "asymmetric_viscous"
    site = Site.FORCE
    sentence = "viscous friction is higher in one direction of travel than in the other"
    check = "vents, exhaust restrictions and the damping of the actuator in both directions"
    parameters = (Parameter("b", "N s/m", "excess of viscous friction at rising position", scale=100.0, neutral=0.0),)

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["b"] * ca.fabs(q.v)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The curvature of the missing force over velocity that is the same on both sides."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"b": lambda r: np.abs(r.v)})]))
