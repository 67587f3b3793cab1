"""The spring-and-diaphragm servomotor: its air, its effective area, its spring.

Source: block diagram of DABLib v1.22 (Bartyś & Syfert, 2002). Chamber pressure pushes the rod down and closes.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from simulator.damadics.actuator.expressions import root
from simulator.damadics.actuator.inputs import Inputs
from simulator.damadics.actuator.positioner import transducer
from simulator.effect import Expression

MASS_LIMIT = 0.1
"""Most air the chamber can hold [kg]."""

PRESSURE_LIMIT = 700e3
"""Highest chamber pressure [Pa, absolute]."""

SPEED_LIMIT = 0.02
"""Rod speed beyond which the published chamber does not follow [m/s]."""


def supply(pz: Expression, f: Any, p: Any) -> Expression:
    """Supply pressure [Pa, relative] behind f16; a positioner does not work on less than its minimum."""
    left = pz * (1 - f[16])
    return ca.if_else(left < p.supply_minimum, 0.0, left)


def area(f: Any, p: Any) -> Expression:
    """Effective area of the diaphragm [m2]; f10 perforates it."""
    return p.diaphragm_area * (1 - f[10])


def inflow(cvi: Expression, pressure: Expression, inputs: Inputs, p: Any) -> Expression:
    """Air into the chamber [kg/s] through the E/P transducer, filling or venting, less what leaks (f9, f10)."""
    f, opening = inputs.f, transducer(cvi, inputs.f, inputs.sense)
    drive = ca.if_else(opening > 0, supply(inputs.supply, f, p), 0.0) - pressure
    leak = p.leak_conductance * (f[9] + f[10]) * ca.sqrt(ca.fabs(pressure))
    return p.conductance * ca.fabs(opening) * root(drive) - leak


def start_air(p: Any, x: float) -> float:
    """Air in the chamber [kg] at atmospheric pressure with the rod at x [m]."""
    return float((p.dead_volume + p.diaphragm_area * x) * p.atmosphere / (p.gas_constant * p.gas_temperature))


def upper_stop(f: Any) -> Expression:
    """Hb: where the rod can go no further [share of the stroke]; f1 clogs, f2 sediments, f3 erodes."""
    return (1 - 0.2 * f[2]) * (1 - f[1]) * (1 + 0.1 * f[3])
