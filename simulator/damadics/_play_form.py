"""The actuator as published: friction is a play of the rod, integrated by RK4 at 2.5 ms.

Source: block diagram of DABLib v1.22 (Bartyś & Syfert, 2002), with the delays of its memory blocks: spring force and
transducer flow see the position and the pressure of the step before. Positions inside the step are in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from simulator._effect import Expression
from simulator._scan import Recurrence
from simulator.damadics import _positioner, _servomotor, _valve_flow
from simulator.damadics._expressions import clip, play
from simulator.damadics._inputs import Inputs
from simulator.damadics._outputs import outputs
from simulator.damadics._parameters import STEP, Parameters, symbols

STATES = ("tick", "cvi", "lever", "q1", "q2", "air", "pressure", "x", "v", "rod", "before", "Ps_before")
"""tick: steps since the positioner sampled; cvi: its held output; lever: feedback lever [share of stroke]; q1, q2: set-
point filter; air [kg] and pressure [Pa, absolute] of the chamber; x [m], v [m/s]: rod ahead of the play; rod [m]: behind
it; before [m]: position of the step before, behind play and stops; Ps_before [Pa, relative]."""

_ROOM = (-0.05, 1.25)
"""How far the rod ahead of the play can go [share of the stroke]."""


def start(p: Parameters, x: float = 0.0) -> dict[str, float]:
    """The states of an actuator at rest at x [m] with an empty chamber, by name; zero where not named."""
    air = _servomotor.start_air(p, x)
    return {"air": air, "pressure": p.atmosphere, "x": x, "rod": x, "before": x, "lever": x / p.stroke}


@dataclass(frozen=True)
class _Held:
    """What a step holds constant."""

    inputs: Inputs
    p: Any
    flow: Expression
    rod: Expression
    before: Expression
    area: Expression
    drop: Expression
    stop: Expression

    @property
    def width(self) -> Expression:
        """Width of the play that stands for friction [m]; f4 widens it, f8 (twisted rod) where the valve is open."""
        f, p = self.inputs.f, self.p
        return p.stroke * clip(p.rod_play + f[4], 0.0, 1.0) * (1 + 0.5 * f[8] * (1 - self.before / p.stroke))

    def position(self, x: Expression) -> Expression:
        """Position of the plug [m] for the rod ahead of the play."""
        return clip(play(x, self.rod, self.width), 0.0, self.stop)

    def rates(self, y: list[Expression]) -> list[Expression]:
        """Rates of q1, q2, air, pressure, x and v."""
        q1, q2, air, pressure, x, v = y
        p, f = self.p, self.inputs.f
        x = clip(x, _ROOM[0] * p.stroke, _ROOM[1] * p.stroke)
        position = self.position(x)
        volume = p.dead_volume + self.area * position
        compression = self.flow * volume / air - self.area * clip(v, -_servomotor.SPEED_LIMIT, _servomotor.SPEED_LIMIT)
        push = self.area * (clip(pressure, 0.0, _servomotor.PRESSURE_LIMIT) - p.atmosphere) + p.mass * p.gravity
        plug = _valve_flow.plug_force(_valve_flow.closing(position / p.stroke, f), self.drop, p)
        spring = (1 - f[11]) * p.spring_rate * (self.before + p.preload_travel)
        force = self._unless_stopped(push - plug - spring - p.viscous * v, position)
        filters = _positioner.filter_rates(q1, q2, self.inputs.setpoint, p)
        return [*filters, self.flow, p.polytropic * pressure * compression / volume, v, force / p.mass]

    def _unless_stopped(self, force: Expression, position: Expression) -> Expression:
        pushes = ca.logic_or(ca.logic_and(position >= self.stop, force > 0), ca.logic_and(position <= 0, force < 0))
        return ca.if_else(pushes, 0.0, force)

    def touches(self, position: Expression) -> Expression:
        """1 at the upper stop, -1 at the lower, 0 between."""
        return ca.if_else(position >= self.stop, 1.0, 0.0) - ca.if_else(position <= 0, 1.0, 0.0)


def play_form() -> Recurrence:
    """One step of 2.5 ms of the published actuator: states `STATES`, inputs `INPUTS`, parameters those of `symbols`."""
    p, parameters = symbols()
    state, inputs = ca.SX.sym("s", len(STATES)), Inputs.symbols()
    s = dict(zip(STATES, ca.vertsplit(state), strict=True))
    f, water = inputs.f, inputs.water()
    still = _Held(inputs, p, ca.SX(0), s["rod"], s["before"], _servomotor.area(f, p), water.drop, p.stroke * _servomotor.upper_stop(f))
    position = still.position(s["x"])
    share = position / p.stroke
    lever = _positioner.lever(_positioner.sensed(share, f), s["lever"], f)
    command = _positioner.controller(s["q2"], _positioner.process_value(lever, p), p)
    cvi = ca.if_else(s["tick"] < 0.5, command, s["cvi"])
    flow = _servomotor.mass_flow(
        _positioner.transducer(cvi, f, inputs.sense), s["Ps_before"], _servomotor.supply(inputs.supply, f, p), f, p
    )
    rod = play(s["x"], s["rod"], still.width)
    held = _Held(inputs, p, flow, rod, s["before"], still.area, still.drop, still.stop)
    new = dict(zip(("q1", "q2", "air", "pressure", "x", "v"), _runge_kutta(held, s), strict=True))
    tick = ca.if_else(s["tick"] + 1.5 > p.hold_steps, 0.0, s["tick"] + 1)
    Ps = s["pressure"] - p.atmosphere
    after = held.position(new["x"])
    new["v"] = ca.if_else(held.touches(after) == held.touches(position), new["v"], 0.0)
    new |= {"tick": tick, "cvi": cvi, "lever": lever, "rod": rod, "before": position, "Ps_before": Ps}
    measured = outputs(inputs, p, water, share, share, cvi, Ps, (s["x"], s["v"], p.viscous * s["v"]))
    return Recurrence(state, inputs.exo, ca.vertcat(*parameters, inputs.sense), ca.vertcat(*(new[n] for n in STATES)), measured)


def _runge_kutta(held: _Held, s: dict[str, Expression]) -> list[Expression]:
    """The continuous states after one step, within their limits."""
    y = [s[name] for name in ("q1", "q2", "air", "pressure", "x", "v")]
    k1 = held.rates(y)
    k2 = held.rates([a + STEP / 2 * k for a, k in zip(y, k1, strict=True)])
    k3 = held.rates([a + STEP / 2 * k for a, k in zip(y, k2, strict=True)])
    k4 = held.rates([a + STEP * k for a, k in zip(y, k3, strict=True)])
    q1, q2, air, pressure, x, v = (
        a + STEP / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(y, k1, k2, k3, k4, strict=True)
    )
    air, pressure = clip(air, 0.0, _servomotor.MASS_LIMIT), clip(pressure, 0.0, _servomotor.PRESSURE_LIMIT)
    return [q1, q2, air, pressure, clip(x, _ROOM[0] * held.p.stroke, _ROOM[1] * held.p.stroke), v]
