"""Viscous friction that differs by direction (equation 2.4, b_i)."""

from __future__ import annotations

import casadi as ca

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values


class AsymmetricViscous(Effect):
    """F = b abs(v): with sigma2 v the coefficients b1 = sigma2 + b and b2 = sigma2 - b of (2.4)."""

    id = "asymmetric_viscous"
    site = Site.FORCE
    sentence = "viscous friction is higher in one direction of travel than in the other"
    check = "vents, exhaust restrictions and the damping of the actuator in both directions"
    parameters = (Parameter("b", "N s/m", "excess of viscous friction at rising position", scale=100.0, neutral=0.0),)

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["b"] * ca.fabs(q.v)
