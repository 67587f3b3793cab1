"""The actuator with friction as a force: the stem is built from effects of the catalogue, at sub-steps of 0.5 ms.

Positioner, chamber and valve are those of the published form. The stem (inertia, spring, LuGre friction, and whatever
else of the catalogue is asked for) is stepped exactly as the toolkit steps it when it fits a valve: implicit midpoint,
exact bristle. Chamber pressure is taken at mid-step, so it is part of the equation that is solved.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from simulator.compile.recurrence import Recurrence
from simulator.compile.step import VectorLayout, force_driven, motion_driven
from simulator.damadics.actuator import past as recall
from simulator.damadics.actuator import positioner, servomotor, valve_flow
from simulator.damadics.actuator.expressions import clip
from simulator.damadics.actuator.inputs import Inputs
from simulator.damadics.actuator.outputs import outputs
from simulator.damadics.actuator.parameters import STEP, Parameters, symbols
from simulator.effect import Effect, Expression, Site

SUBSTEPS = 5
"""Sub-steps of a step of 2.5 ms."""

FRONT = ("tick", "cvi", "lever", "q1", "q2", "air", "flow", "load", "w")
"""States ahead of those of the stem, as in the published form, but: tick counts sub-steps; flow is the air that the
transducer lets in [kg/s] and load the force of the flow on the plug less the weight [N], which act one sub-step after
the inputs that made them, where the published form is a whole step late: it keeps the equation to solve small; w is the
velocity in the middle of the last sub-step [m/s], from which the next one is looked for."""

LUGRE = {"fc": 116.0, "fs": 160.0, "vs": 1e-3, "sigma0": 3e6, "sigma1": 3.5e3, "sigma2": 1500.0}
"""Default friction. fc: half of the 8 kPa hysteresis of the measured valve signature times the diaphragm area; fs:
1.4 fc; sigma0: presliding of about 0.05 mm; sigma1: 0.7 of critical damping; sigma2: the library's viscous friction."""

SUBSTEP = STEP / SUBSTEPS

_SMALL_SPEED = 1e-2
"""The equation is solved to 1e-10 of this [m/s], far below what any sensor sees."""


def base_values(p: Parameters) -> dict[str, dict[str, float]]:
    """Values of the base effects by effect and symbol."""
    return {"inertia": {"m": p.mass}, "spring": {"K": p.spring_rate, "F0": p.preload}, "lugre": dict(LUGRE)}


class _Stem:
    """The catalogue's recurrence of some effects, with expressions of ours put in for its inputs and parameters."""

    def __init__(self, effects: tuple[Effect, ...]) -> None:
        rubbing = tuple(e for e in effects if e.site is Site.FORCE and e.id not in ("inertia", "spring"))
        driven, self.layout = force_driven(effects)
        imposed, self._rubbing = motion_driven(rubbing)
        arguments: list[Any] = [driven.state, driven.exo, driven.parameters]
        moving: tuple[list[Any], list[Any]] = [driven.implicit, *arguments], [driven.step, driven.residual]
        self._step = ca.Function("stem", *moving)
        self._reported = ca.Function("reported", arguments, [driven.output])
        self._friction = ca.Function("friction", [imposed.state, imposed.exo, imposed.parameters], [imposed.output])

    def step(
        self, w: Expression, s: Expression, t: Expression, u: tuple[Expression, Expression], p: Expression
    ) -> tuple[Expression, Expression]:
        """The next state and the residual for velocity w at mid-step and inputs u at middle and end of the step."""
        after, residual = self._step(w, s, ca.vertcat(t, SUBSTEP, *u)[: self._step.numel_in(2)], p)
        return after, residual

    def reported(self, s: Expression, t: Expression, u: Expression, p: Expression) -> Expression:
        """Position [m] behind the effects between stem and sensor."""
        still = ca.vertcat(u, ca.DM.zeros(2)) if self.layout.delay else u
        return self._reported(s, ca.vertcat(t, 0.0, still, still)[: self._reported.numel_in(1)], p)

    def friction(self, s: Expression, t: Expression, u: Expression, p: Mapping[str, Expression]) -> Expression:
        """Force of all effects on the stem but inertia and spring [N]."""
        by_name = dict(zip(self.layout.states, ca.vertsplit(s), strict=True))
        memory = ca.vertcat(*(by_name[name] for name in self._rubbing.states))
        values = ca.vertcat(*(p[name] for name in self._rubbing.parameters))
        motion = ca.vertcat(by_name["x"], by_name["v"], 0.0, u)
        later = [motion] if self._friction.numel_in(1) == 10 else []
        return self._friction(memory, ca.vertcat(t, 0.0, motion, *later), values)


def force_form(effects: tuple[Effect, ...]) -> tuple[Recurrence, VectorLayout]:
    """One sub-step of 0.5 ms: the states of `state_names`; parameters of `symbols`, the layout, and the sense.

    effects : inertia, spring and LuGre friction, and any others, in the order of the catalogue.
    """
    stem, (p, parameters), inputs = _Stem(effects), symbols(), Inputs.symbols()
    front, s, w = ca.SX.sym("s", len(FRONT)), ca.SX.sym("z", len(stem.layout.states)), ca.SX.sym("w")
    past = [ca.SX.sym(name) for name in recall.names(stem.layout)]
    given = {name: ca.SX.sym(name) for name in stem.layout.parameters}
    now = _Instant(stem, inputs, p, given, dict(zip(FRONT, ca.vertsplit(front), strict=True)), s, past)
    new, residual = now.advance(w)
    measured = now.outputs()
    vector = ca.vertcat(*parameters, *given.values(), inputs.sense)
    recurrence = Recurrence(
        ca.vertcat(front, *past, s),
        inputs.exo,
        vector,
        new,
        measured,
        w,
        residual,
        guess=now.front["w"],
        scale=_SMALL_SPEED,
        differentiable=False,
    )
    return recurrence, stem.layout


def state_names(layout: VectorLayout) -> tuple[str, ...]:
    """All states of the form, in order: `FRONT`, forces of the last steps where an effect delays them, the stem's."""
    return (*FRONT, *recall.names(layout), *layout.states)


class _Instant:
    """The actuator at the start of a sub-step."""

    def __init__(
        self, stem: _Stem, inputs: Inputs, p: Any, given: Mapping[str, Expression], front: dict[str, Expression],
        s: Expression, past: list[Expression],
    ) -> None:  # fmt: skip
        self.stem, self.inputs, self.p, self.front, self.s, self.past = stem, inputs, p, front, s, past
        self.f, self.t, self.water = inputs.f, inputs.exo[0], inputs.water()
        self.x, self.v, self.weight = s[0], s[1], given["mass.m"] * p.gravity
        self.values = faulty(given, self.f, self.x / p.stroke, p)
        self.vector = ca.vertcat(*self.values.values())
        self.Ps = self.pressure(front["air"], self.x)
        self.u = servomotor.area(self.f, p) * self.Ps
        self.reported = stem.reported(s, self.t, self.u, self.vector) / p.stroke
        self.lever, self.cvi = positioner.sampled(self.reported, front, self.f, p)

    def pressure(self, air: Expression, x: Expression) -> Expression:
        """Chamber pressure [Pa, relative]. A perforated diaphragm (f10) pushes less, but the chamber is as large."""
        p = self.p
        absolute = air * p.gas_constant * p.gas_temperature / (p.dead_volume + p.diaphragm_area * x)
        return clip(absolute, 0.0, servomotor.PRESSURE_LIMIT) - p.atmosphere

    def advance(self, w: Expression) -> tuple[Expression, Expression]:
        """The state after the sub-step and the residual of the force balance, for velocity w at mid-step."""
        stop = self.p.stroke * servomotor.upper_stop(self.f)
        u = self._push(w, 0.5), self._push(w, 1.0)
        _, residual = self.stem.step(w, self.s, self.t, u, self.vector)
        free = clip(w, -self.x / SUBSTEP, (stop - self.x) / SUBSTEP)
        stem, _ = self.stem.step(free, self.s, self.t, u, self.vector)
        stem[1] = ca.if_else(free == w, stem[1], 0.0)
        past = recall.kept(self.t, self.u, self.past, SUBSTEP)
        return ca.vertcat(*self._front(stem), w, *past, stem), residual + self.front["load"]

    def _push(self, w: Expression, part: float) -> Expression:
        """Inputs of the stem a part of the sub-step later: the force of the diaphragm [N], and what a delay changes."""
        u = self._force(w, part)
        if not self.stem.layout.delay:
            return u
        delay = self.values[self.stem.layout.delay]
        before = recall.earlier(self.t, self.u, u, part * SUBSTEP, self.past, delay, SUBSTEP)
        return ca.vertcat(u, before - u, 0.0)

    def _force(self, w: Expression, part: float) -> Expression:
        """Force of the diaphragm [N] a part of the sub-step later, when the rod has moved at w."""
        x = clip(self.x + part * SUBSTEP * w, 0.0, 1.25 * self.p.stroke)
        air = self.front["air"] + part * SUBSTEP * self.front["flow"]
        return servomotor.area(self.f, self.p) * self.pressure(air, x)

    def _front(self, stem: Expression) -> list[Expression]:
        """The states of `FRONT` after the sub-step."""
        p, front = self.p, self.front
        rate1, rate2 = positioner.filter_rates(front["q1"], front["q2"], self.inputs.setpoint, p)
        tick = positioner.next_tick(front["tick"], SUBSTEPS * p.hold_steps)
        air = clip(front["air"] + SUBSTEP * front["flow"], 0.0, servomotor.MASS_LIMIT)
        flow = servomotor.inflow(self.cvi, self.Ps, self.inputs, p)
        q1, q2 = front["q1"] + SUBSTEP * rate1, front["q2"] + SUBSTEP * rate2
        # At the middle of the next sub-step, as far as position and velocity at its start tell.
        closing = valve_flow.closing((stem[0] + SUBSTEP / 2 * stem[1]) / p.stroke, self.f)
        load = valve_flow.plug_force(closing, self.water.drop, p) - self.weight
        return [tick, self.cvi, self.lever, q1, q2, air, flow, load]

    def outputs(self) -> Expression:
        """The signals at this instant."""
        rod = self.x, self.v, self.stem.friction(self.s, self.t, self.u, self.values)
        share = self.x / self.p.stroke
        return outputs(self.inputs, self.p, self.water, share, self.reported, self.cvi, self.Ps, rod)


def faulty(given: Mapping[str, Expression], f: Any, position: Expression, p: Any) -> dict[str, Expression]:
    """The parameters of the stem with f11 (spring) and f4, f8 (friction) in them.

    A full f4 > 0 adds the force that matches the widened play of the published form, k H0 / 2; f4 < 0 takes friction
    away; f8, a twisted rod, adds up to half where the valve is open.
    """
    values = dict(given)
    for name in ("spring.K", "spring.F0"):
        values[name] = given[name] * (1 - f[11])
    fc, fs = given["lugre.fc"], given["lugre.fs"]
    added = ca.if_else(f[4] > 0, f[4] * p.spring_rate * p.stroke / 2, 0.0)
    factor = (1 + ca.if_else(f[4] < 0, f[4], 0.0)) * (1 + 0.5 * f[8] * (1 - position))
    values["lugre.fc"] = (fc + added) * factor
    values["lugre.fs"] = (fs + added * ca.if_else(fc > 0, fs / fc, 1.0)) * factor
    return values
