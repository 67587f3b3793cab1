"""The actuator as published: friction is a play of the rod, integrated by RK4 at 2.5 ms.

Source: block diagram of DABLib v1.22 (Bartyś & Syfert, 2002), with the delays of its memory blocks: spring force and
transducer flow see the position and the pressure of the step before. Positions inside the step are in metres.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from simulator.compile.recurrence import Recurrence
from simulator.damadics.actuator import positioner, servomotor, valve_flow
from simulator.damadics.actuator.expressions import clip, play
from simulator.damadics.actuator.inputs import Inputs
from simulator.damadics.actuator.outputs import outputs
from simulator.damadics.actuator.parameters import STEP, Parameters, symbols
from simulator.effect import Expression

STATES = ("tick", "cvi", "lever", "q1", "q2", "air", "pressure", "x", "v", "rod", "before", "Ps_before")
"""tick: steps since the positioner sampled; cvi: its held output; lever: feedback lever [share of the stroke]; q1, q2:
set-point filter; air [kg] and pressure [Pa, absolute] of the chamber; x [m], v [m/s]: rod ahead of the play; rod [m]:
behind it; before [m]: position of the step before, behind play and stops; Ps_before [Pa, relative]."""

_CONTINUOUS = ("q1", "q2", "air", "pressure", "x", "v")

_ROOM = (-0.05, 1.25)
"""How far the rod ahead of the play can go [share of the stroke]."""


def start(p: Parameters, x: float = 0.0) -> dict[str, float]:
    """The states of an actuator at rest at x [m] with an empty chamber, by name; zero where not named."""
    air = servomotor.start_air(p, x)
    return {"air": air, "pressure": p.atmosphere, "x": x, "rod": x, "before": x, "lever": x / p.stroke}


def play_form() -> Recurrence:
    """One step of 2.5 ms of the published actuator: states `STATES`, inputs `INPUTS`, parameters those of `symbols`."""
    (p, parameters), inputs, state = symbols(), Inputs.symbols(), ca.SX.sym("s", len(STATES))
    now = _Instant(inputs, p, dict(zip(STATES, ca.vertsplit(state), strict=True)))
    after = now.step()
    step, vector = ca.vertcat(*(after[name] for name in STATES)), ca.vertcat(*parameters, inputs.sense)
    return Recurrence(state, inputs.exo, vector, step, now.outputs(), differentiable=False)


class _Instant:
    """The actuator at the start of a step, and all that the step holds constant."""

    def __init__(self, inputs: Inputs, p: Any, s: dict[str, Expression]) -> None:
        self.inputs, self.p, self.s = inputs, p, s
        self.f, self.water = inputs.f, inputs.water()
        self.area, self.stop = servomotor.area(self.f, p), p.stroke * servomotor.upper_stop(self.f)
        # f4 widens the play, f8 (twisted rod) does where the valve is open.
        self.width = p.stroke * clip(p.rod_play + self.f[4], 0.0, 1.0)
        self.width *= 1 + 0.5 * self.f[8] * (1 - s["before"] / p.stroke)
        self.rod = play(s["x"], s["rod"], self.width)
        self.position = clip(self.rod, 0.0, self.stop)
        self.lever, self.cvi = positioner.sampled(self.position / p.stroke, s, self.f, p)
        self.flow = servomotor.inflow(self.cvi, s["Ps_before"], inputs, p)

    def behind(self, x: Expression) -> Expression:
        """Position of the plug [m] for the rod ahead of the play at x."""
        return clip(play(x, self.rod, self.width), 0.0, self.stop)

    def rates(self, y: list[Expression]) -> list[Expression]:
        """Rates of `_CONTINUOUS`."""
        q1, q2, air, pressure, x, v = y
        p, limit = self.p, servomotor.SPEED_LIMIT
        position = self.behind(self._within(x))
        volume = p.dead_volume + self.area * position
        compression = self.flow * volume / air - self.area * clip(v, -limit, limit)
        filters = positioner.filter_rates(q1, q2, self.inputs.setpoint, p)
        acceleration = self._force(pressure, position, v) / p.mass
        return [*filters, self.flow, p.polytropic * pressure * compression / volume, v, acceleration]

    def _force(self, pressure: Expression, position: Expression, v: Expression) -> Expression:
        """Net force on the rod [N], none when it pushes into a stop."""
        p, f = self.p, self.f
        push = self.area * (clip(pressure, 0.0, servomotor.PRESSURE_LIMIT) - p.atmosphere) + p.mass * p.gravity
        plug = valve_flow.plug_force(valve_flow.closing(position / p.stroke, f), self.water.drop, p)
        spring = (1 - f[11]) * p.spring_rate * (self.s["before"] + p.preload_travel)
        force = push - plug - spring - p.viscous * v
        closed, opened = position >= self.stop, position <= 0
        pushes = ca.logic_or(ca.logic_and(closed, force > 0), ca.logic_and(opened, force < 0))
        return ca.if_else(pushes, 0.0, force)

    def step(self) -> dict[str, Expression]:
        """The states after the step, by name; the rod stops dead when it reaches or leaves a stop."""
        p, s = self.p, self.s
        after = dict(zip(_CONTINUOUS, self._runge_kutta(), strict=True))
        after["x"] = self._within(after["x"])
        after["air"] = clip(after["air"], 0.0, servomotor.MASS_LIMIT)
        after["pressure"] = clip(after["pressure"], 0.0, servomotor.PRESSURE_LIMIT)
        same = self._touches(self.behind(after["x"])) == self._touches(self.position)
        after["v"] = ca.if_else(same, after["v"], 0.0)
        after |= {"tick": positioner.next_tick(s["tick"], p.hold_steps), "cvi": self.cvi, "lever": self.lever}
        return after | {"rod": self.rod, "before": self.position, "Ps_before": s["pressure"] - p.atmosphere}

    def _runge_kutta(self) -> list[Expression]:
        y = [self.s[name] for name in _CONTINUOUS]
        k1 = self.rates(y)
        k2 = self.rates([a + STEP / 2 * k for a, k in zip(y, k1, strict=True)])
        k3 = self.rates([a + STEP / 2 * k for a, k in zip(y, k2, strict=True)])
        k4 = self.rates([a + STEP * k for a, k in zip(y, k3, strict=True)])
        return [a + STEP / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(y, k1, k2, k3, k4, strict=True)]

    def _within(self, x: Expression) -> Expression:
        return clip(x, _ROOM[0] * self.p.stroke, _ROOM[1] * self.p.stroke)

    def _touches(self, position: Expression) -> Expression:
        """1 at the upper stop, -1 at the lower, 0 between."""
        return ca.if_else(position >= self.stop, 1.0, 0.0) - ca.if_else(position <= 0, 1.0, 0.0)

    def outputs(self) -> Expression:
        """The signals at this instant; the only friction that is a force is the viscous one."""
        s, p, share = self.s, self.p, self.position / self.p.stroke
        rod = s["x"], s["v"], p.viscous * s["v"]
        return outputs(self.inputs, p, self.water, share, share, self.cvi, s["pressure"] - p.atmosphere, rod)
