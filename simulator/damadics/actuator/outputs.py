"""What can be seen of the actuator at one instant, in physical units."""

from __future__ import annotations

from typing import Any

import casadi as ca

from simulator.damadics.actuator import positioner, servomotor, valve_flow
from simulator.damadics.actuator.inputs import Inputs
from simulator.damadics.actuator.valve_flow import Fluid
from simulator.effect import Expression

SIGNALS = {
    "CV": "1", "P1": "Pa", "P2": "Pa", "T1": "degC", "X": "1", "F": "t/h",
    "CVI": "1", "Ps": "Pa", "Pz": "Pa",
    "Fv": "t/h", "Fv3": "t/h", "Fvc": "N", "X3": "1", "position": "1", "pressure": "Pa",
    "x": "m", "v": "m/s", "friction": "N", "density": "kg/m3",
}  # fmt: skip
"""Signals of an actuator and their units. Up to F: the benchmark's basic measurements; up to Pz: the extended ones; all
as their sensors have them, with their faults and without noise. Then what is never measured: flow of valve and bypass,
force on the plug, closing of the bypass, true position [share of the stroke] and chamber pressure [Pa, relative], rod
(x, v), friction force, density of the water."""


def outputs(
    inputs: Inputs,
    p: Any,
    water: Fluid,
    position: Expression,
    reported: Expression,
    cvi: Expression,
    Ps: Expression,
    rod: tuple[Expression, Expression, Expression],
) -> Expression:
    """The column of `SIGNALS`. position: true; reported: ahead of the sensor's fault [shares]; rod: x, v, friction."""
    f, sense = inputs.f, inputs.sense
    xr = valve_flow.closing(position, f)
    main = valve_flow.main_flow(xr, water, f, p)
    bypass, x3 = valve_flow.bypass_flow(water, f, p)
    plug = valve_flow.plug_force(xr, water.drop, p)
    sensors = [positioner.sensed(reported, f), (main + bypass) * (1 + sense * f[19])]
    extended = [cvi, Ps * (1 + sense * f[14]), servomotor.supply(inputs.supply, f, p)]
    hidden = [main, bypass, plug, x3, position, Ps, *rod, water.rho]
    return ca.vertcat(inputs.setpoint, water.P1, water.P2, inputs.exo[5], *sensors, *extended, *hidden)
