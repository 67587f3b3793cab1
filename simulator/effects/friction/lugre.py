"""LuGre friction of packing and guides (Canudas de Wit et al., IEEE TAC 40(3), 1995, eq. 1-5)."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.relaxation import Relaxation

LEAST_LEVEL = 1e-6
"""Friction level [N] that no combination of effects goes below: far under any valve's, and bristles yield at zero."""


class LuGre(Effect):
    """F = sigma0 z + sigma1 dz/dt + sigma2 v, dz/dt = v - sigma0 abs(v) z / g(v), g = fc + (fs - fc) exp(-(v/vs)^2).

    Nothing forces fs >= fc: in real drives friction can fall towards zero speed. The model is passive only while
    sigma1 is small against sigma2, so it does not claim to be (Barahanov and Ortega, IEEE TAC 45(4), 2000).
    """

    id = "lugre"
    site = Site.FORCE
    sentence = "friction of packing and guides with presliding, break-away and the Stribeck effect"
    check = "packing torque, stem finish and guide alignment"
    parameters = (
        Parameter("fc", "N", "Coulomb friction: level at speed", scale=150.0, lower=0.0, positive=True),
        Parameter("fs", "N", "static friction: level near zero speed", scale=200.0, lower=0.0, positive=True),
        Parameter("vs", "m/s", "Stribeck velocity", scale=5e-3, lower=0.0, positive=True),
        Parameter("sigma0", "N/m", "bristle stiffness", scale=1e6, lower=0.0, positive=True),
        Parameter("sigma1", "N s/m", "bristle damping", scale=1e3, lower=0.0),
        Parameter("sigma2", "N s/m", "viscous friction", scale=300.0, lower=0.0),
    )
    memory = (Memory("z", "m", free=True),)

    def level(self, v: Expression, p: Values) -> Expression:
        """Friction level g(v) [N] at steady sliding, without the viscous part."""
        return p["fc"] + (p["fs"] - p["fc"]) * ca.exp(-((v / p["vs"]) ** 2))

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Relaxation]:
        level = q.friction * self.level(q.speed, p)
        level = ca.if_else(level < LEAST_LEVEL, LEAST_LEVEL, level)  # unlike fmax this passes on a NaN
        return {"z": Relaxation(q.v, p["sigma0"] * ca.fabs(q.v) / level)}

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["sigma0"] * s["z"] + p["sigma1"] * ds["z"] + p["sigma2"] * q.v
