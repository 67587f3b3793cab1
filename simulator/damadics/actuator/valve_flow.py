"""The control valve, its bypass, and the water in them: flow, choked flow, and the force on the plug.

Source: block diagram of DABLib v1.22 (Bartyś & Syfert, 2002). Opening 1 is closed: x counts from open to closed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from simulator.damadics.actuator.expressions import Knots, clip, root, table
from simulator.effect import Expression

RECOVERY: Knots = (
    (0.0, 1.0), (0.1, 0.95), (0.2, 0.90), (0.3, 0.85), (0.4, 0.785), (0.5, 0.725),
    (0.6, 0.67), (0.7, 0.61), (0.8, 0.555), (0.9, 0.5), (0.99, 0.45), (1.0, 0.40),
)  # fmt: skip
"""Km: pressure recovery of the valve by closing [1 -> 1]."""

BYPASS_RECOVERY: Knots = (
    (0.0, 0.45), (0.1, 0.5), (0.2, 0.555), (0.3, 0.61), (0.4, 0.67), (0.5, 0.725),
    (0.6, 0.785), (0.7, 0.85), (0.8, 0.90), (0.9, 0.95), (1.0, 1.0),
)  # fmt: skip
"""Km of the bypass valve by closing [1 -> 1]."""

CRITICAL_RATIO: Knots = (
    (0.0, 0.94), (1.724, 0.87), (3.448, 0.84), (6.895, 0.79), (13.79, 0.75), (17.24, 0.725), (20.69, 0.685),
)  # fmt: skip
"""rc: critical pressure ratio of water by inlet pressure [MPa -> 1]."""

COMPRESSIBILITY: Knots = ((0.0, 5.26), (10.0, 5.02), (20.0, 4.81), (50.0, 4.69), (110.0, 4.42))
"""C: compressibility of water by temperature [degC -> 1e-10/Pa]."""

_NEARLY_CLOSED = 0.975
_LN10 = 2.302585092994046


@dataclass(frozen=True)
class Fluid:
    """What the pipe offers: P1, P2 at the valve [Pa] and T in the valve [degC], with their faults; pe, the inlet or
    vapour pressure, whichever is higher, critical, the pressure at which it boils in the valve [Pa], rho [kg/m3].
    """

    P1: Expression
    P2: Expression
    pe: Expression
    critical: Expression
    rho: Expression

    @property
    def drop(self) -> Expression:
        """Pressure drop over the valve [Pa]."""
        return self.pe - self.P2

    def effective_drop(self, recovery: Expression) -> Expression:
        """Pressure drop [Pa] that drives the flow: limited where the flow chokes."""
        allowed = recovery * (self.pe - self.critical)
        return ca.if_else(self.drop < allowed, self.drop, ca.if_else(allowed > 0, allowed, 0.0))


def fluid(P1: Expression, P2: Expression, T: Expression, f: Any) -> Fluid:
    """The state of the water; f7 heats it above boiling, f17 lowers P2 (positive) or P1 (negative)."""
    lowered, raised = ca.if_else(f[17] > 0, f[17], 0.0), ca.if_else(f[17] < 0, -f[17], 0.0)
    P1, P2 = P1 * (1 - raised), P2 * (1 - lowered)
    heated = clip(T, 0.0, 200.0) + ca.if_else(f[7] > 0, 200.0 + 100.0 * f[7], 0.0)
    heated = ca.if_else(heated > 300.0, 300.0, heated)
    vapour = ca.exp(_LN10 * (10.7167 - 2141.0 / (heated + 273.15)))
    pe = ca.if_else(vapour < P1, P1, vapour)
    return Fluid(P1, P2, pe, table(pe * 1e-6, CRITICAL_RATIO) * vapour, density(heated, pe))


def density(T: Expression, P: Expression) -> Expression:
    """Density of water [kg/m3] at T [degC], limited to 0..110, and P [Pa]."""
    t = clip(T, 0.0, 110.0)
    hot = (t - 4) ** 2 / 466700 / (t + 67) * (t + 273) * (350 - t) / (365 - t)
    cold = (t - 4) ** 2 / 503570 / (t + 67.2) * (t + 283)
    return 1000.0 * (1 - ca.if_else(t < 30, cold, hot)) / (1 - table(t, COMPRESSIBILITY) * 1e-10 * P)


def closing(position: Expression, f: Any) -> Expression:
    """xr: how far the valve is closed [1] at a rod position [share of the stroke]; f2 is sediment, f3 erosion."""
    return clip(clip(position + 0.2 * f[2], 0.0, 1.0) - 0.1 * f[3], 0.0, 1.0)


def plug_force(xr: Expression, drop: Expression, p: Any) -> Expression:
    """Fvc: force of the flow on the plug [N] against closing."""
    return drop / table(xr, RECOVERY) * (ca.pi / 4) * p.plug_diameter**2


def main_flow(xr: Expression, water: Fluid, f: Any, p: Any) -> Expression:
    """Fv: flow through the valve [t/h], equal percentage and linear to zero near closing; f5 leaks, f6 leaks inside."""
    nearly = xr > _NEARLY_CLOSED
    opening = ca.exp(-5 * ca.if_else(nearly, _NEARLY_CLOSED, xr))
    opening = opening * ca.if_else(nearly, (1 - xr) / (1 - _NEARLY_CLOSED), 1.0)
    opening = clip(clip(opening * (1 - 0.2 * f[2]), 0.0, 1.0) * (1 + 0.1 * f[3]), 0.0, 1.0) + 0.1 * f[6]
    drop = water.effective_drop(table(xr, RECOVERY))
    return p.flow_gain * opening * 0.1 * root(drop * 1e-6 / water.rho) * water.rho * (1 - 0.05 * f[5])


def bypass_flow(water: Fluid, f: Any, p: Any) -> tuple[Expression, Expression]:
    """Fv3 [t/h] and X3, how far the bypass is closed [1]; f18 opens it."""
    x3 = 1 - f[18]
    drop = water.effective_drop(table(x3, BYPASS_RECOVERY))
    return p.bypass_gain * f[18] * 100 * root(drop * 1e-9), x3
