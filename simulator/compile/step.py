"""The step of the stiff model: implicit midpoint in the velocity, exact update of the relaxing memory states.

Every step reduces to one scalar equation in the velocity at mid-step: with it the relaxing states (the bristle) have
their exact update and their exact mean, and the mean forces balance the inertia. Second order, and no stiffness limit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from simulator.compile.recurrence import AHEAD, Recurrence
from simulator.effect import Effect, Memory, Quantities, Site, Values
from simulator.relaxation import Expression

States = dict[str, dict[str, Expression]]
"""Expressions by effect id and memory symbol."""


@dataclass(frozen=True)
class VectorLayout:
    """Which parameter and which state of which effect stands where in the kernel's vectors.

    delay : full name of the parameter by which an effect looks back in the force, empty where none does.
    """

    parameters: tuple[str, ...]
    states: tuple[str, ...]
    memory: tuple[Memory, ...]
    delay: str = ""

    @classmethod
    def of(cls, effects: tuple[Effect, ...], imposed: bool) -> VectorLayout:
        """The layout for some effects; with the motion imposed, x and v are inputs instead of states."""
        names = tuple(name for effect in effects for name in effect.parameter_names())
        memory = tuple(m for effect in effects for m in effect.memory)
        labels = tuple(f"{effect.id}.{m.symbol}" for effect in effects for m in effect.memory)
        delays = [effect.parameter_name(effect.delay) for effect in effects if effect.delay]
        if len(delays) > 1:
            raise ValueError(f"{' and '.join(delays)} both delay the force; a valve has one dead time")
        return cls(names, labels if imposed else ("x", "v", *labels), memory, "".join(delays))


@dataclass(frozen=True)
class _Course:
    """A step as the effects see it: quantities and memory at its middle, rates of change, memory at its end."""

    middle: Quantities
    mean: States
    rate: States
    end: States


class _Assembly:
    """The symbols of one kernel, and the walk over its effects in the order in which they are asked."""

    def __init__(self, effects: tuple[Effect, ...], imposed: bool) -> None:
        self.effects = effects
        self.asked = sorted(effects, key=_turn)
        self.layout = VectorLayout.of(effects, imposed)
        self.p = ca.SX.sym("p", len(self.layout.parameters))
        self.s = ca.SX.sym("s", len(self.layout.states))
        by_name = {name: self.p[i] for i, name in enumerate(self.layout.parameters)}
        self.values = {
            e.id: {par.symbol: by_name[e.parameter_name(par.symbol)] for par in e.parameters} for e in effects
        }
        by_label = {label: self.s[i] for i, label in enumerate(self.layout.states)}
        self.held = {e.id: {m.symbol: by_label[f"{e.id}.{m.symbol}"] for m in e.memory} for e in effects}

    def late(self, inputs: Expression) -> Expression:
        """What the delay changes in the force, from the inputs of a force-driven kernel: `delay_columns`."""
        if not self.layout.delay:
            return 0.0
        return inputs[1] - inputs[2] * self.p[self.layout.parameters.index(self.layout.delay)]

    def step(self, middle: Quantities, end: Quantities, h: Expression) -> _Course:
        """One step h from the held memory, given the raw quantities at its middle and end."""
        mean, rate, last = dict(self.held), {}, dict(self.held)
        for e in self.asked:
            p, held = self.values[e.id], self.held[e.id]
            laws, laws_at_end = e.relax(middle, p), e.relax(end, p)
            courses = {symbol: law.over(held[symbol], h, laws_at_end[symbol]) for symbol, law in laws.items()}
            mean[e.id] = held | {symbol: course.mean for symbol, course in courses.items()}
            last[e.id] = held | {symbol: course.end for symbol, course in courses.items()}
            rate[e.id] = {symbol: course.rate for symbol, course in courses.items()}
            mean[e.id] |= e.jump(middle, p, mean[e.id])
            last[e.id] |= e.jump(end, p, last[e.id])
            middle, end = _behind(e, middle, p, mean[e.id]), _behind(e, end, p, last[e.id])
        return _Course(middle, mean, rate, last)

    def stage(self, end: Quantities, h: Expression) -> _Course:
        """A backward Euler step h from the held memory, given the raw quantities at its end."""
        rate, last = dict(self.held), dict(self.held)
        for e in self.asked:
            p, held = self.values[e.id], self.held[e.id]
            moved = {symbol: law.implicit(held[symbol], h) for symbol, law in e.relax(end, p).items()}
            last[e.id] = held | moved
            rate[e.id] = {symbol: (s - held[symbol]) / h for symbol, s in moved.items()}
            last[e.id] |= e.jump(end, p, last[e.id])
            end = _behind(e, end, p, last[e.id])
        return _Course(end, last, rate, last)

    def sample(self, q: Quantities) -> tuple[Quantities, States]:
        """Quantities behind all effects at an instant with the held memory, and the rates of change there."""
        rate: States = {}
        for e in self.asked:
            p, held = self.values[e.id], self.held[e.id]
            rate[e.id] = {symbol: law.now(held[symbol]) for symbol, law in e.relax(q, p).items()}
            q = _behind(e, q, p, held)
        return q, rate

    def force(self, q: Quantities, s: States, ds: States) -> Expression:
        """Sum of the forces of all effects [N]."""
        return sum((e.force(q, self.values[e.id], s[e.id], ds[e.id]) for e in self.effects), start=ca.SX(0.0))

    def memory(self, states: States) -> list[Expression]:
        """The memory states in the order of the layout."""
        return [states[e.id][m.symbol] for e in self.effects for m in e.memory]

    def recurrence(
        self, t: Expression, h: Expression, inputs: Expression, at_end: Expression, *, step: Expression,
        output: Expression, **implicit: Expression,
    ) -> Recurrence:  # fmt: skip
        """The recurrence, which asks for the inputs at the end of a sub-step only when an effect needs them."""
        ends = bool(ca.depends_on(ca.vertcat(step, implicit.get("residual", 0.0)), at_end))
        exo = ca.vertcat(t, h, inputs, at_end) if ends else ca.vertcat(t, h, inputs)
        return Recurrence(self.s, exo, self.p, step, output, ends=ends, **implicit)


def _turn(effect: Effect) -> int:
    """Rank in the order of asking: whoever shapes a quantity comes before those that use it."""
    if effect.site is Site.FORCE:
        kind = type(effect)
        shapes = kind.friction_level, kind.friction_speed
        return 2 if shapes == (Effect.friction_level, Effect.friction_speed) else 1
    return 0 if effect.site is Site.INPUT else 3


def _behind(effect: Effect, q: Quantities, p: Values, s: Values) -> Quantities:
    """The quantities behind an effect: what it makes of the input, friction's level and speed, or the output."""
    if effect.site is Site.INPUT:
        return replace(q, u=effect.input(q, p, s))
    if effect.site is Site.OUTPUT:
        return replace(q, y=effect.output(q, p, s))
    level, speed = effect.friction_level(q, p, s), effect.friction_speed(q, p, s)
    return replace(q, friction=q.friction * level, speed=speed)


def force_driven(effects: tuple[Effect, ...]) -> tuple[Recurrence, VectorLayout]:
    """Force in, position out: states [x, v, memory...], input u [N], output the measured position [m].

    Where an effect has a delay, the inputs are u and the two `delay_columns`.
    """
    a = _Assembly(effects, imposed=False)
    t, h, w = (ca.SX.sym(name) for name in ("t", "h", "w"))
    u, later = (ca.SX.sym(name, 3 if a.layout.delay else 1) for name in ("u", "later"))
    x, v = a.s[0], a.s[1]
    acceleration, middle, end = 2 * (w - v) / h, x + h / 2 * w, x + h * w
    course = a.step(
        Quantities(t, middle, w, acceleration, u[0], middle, speed=w, late=a.late(u)),
        Quantities(t + h / 2, end, 2 * w - v, acceleration, later[0], end, speed=2 * w - v, late=a.late(later)),
        h,
    )
    seen, _ = a.sample(Quantities(t, x, v, 0.0, u[0], x, speed=v, late=a.late(u)))
    recurrence = a.recurrence(
        t, h, u, later,
        step=ca.vertcat(end, 2 * w - v, *a.memory(course.end)), output=ca.SX(seen.y), implicit=w, guess=v,
        residual=a.force(course.middle, course.mean, course.rate) - course.middle.u,
    )  # fmt: skip
    return recurrence, a.layout


def force_driven_damped(effects: tuple[Effect, ...]) -> tuple[Recurrence, VectorLayout]:
    """As `force_driven`, by the two stages of SDIRK2, each a backward Euler step: second order and L-stable, so what
    the sub-step does not resolve is damped instead of ringing (Alexander, SIAM J. Numer. Anal. 14(6), 1977).
    """
    a = _Assembly(effects, imposed=False)
    t, h, w = (ca.SX.sym(name) for name in ("t", "h", "w"))
    u = ca.SX.sym("u", 3 if a.layout.delay else 1)
    x, v = a.s[0], a.s[1]
    end = x + h * w
    course = a.stage(Quantities(t, end, w, (w - v) / h, u[0], end, speed=w, late=a.late(u)), h)
    seen, _ = a.sample(Quantities(t, x, v, 0.0, u[0], x, speed=v, late=a.late(u)))
    relaxing = {f"{e.id}.{s}" for e in effects for s in e.relax(course.middle, a.values[e.id])}
    recurrence = Recurrence(
        a.s, ca.vertcat(t, h, u), a.p, ca.vertcat(end, w, *a.memory(course.end)), ca.SX(seen.y), implicit=w, guess=v,
        residual=a.force(course.middle, course.mean, course.rate) - course.middle.u,
        ahead=tuple(AHEAD if name in relaxing | {"x", "v"} else 1.0 for name in a.layout.states),
    )  # fmt: skip
    return recurrence, a.layout


def force_with_error_damped(effects: tuple[Effect, ...]) -> tuple[Recurrence, VectorLayout]:
    """As `force_with_error`, by the two stages of SDIRK2."""
    driven, layout = force_driven_damped(effects)
    n = 2 if layout.delay else 0
    u, slope, t, h = (ca.SX.sym(name) for name in ("u", "slope", "t", "h"))
    columns = ca.SX.sym("columns", n)
    exo = ca.vertcat(t, h, u + h * slope, columns)
    old: Expression = [driven.step, driven.output, driven.residual, driven.guess]
    step, output, residual, guess = ca.substitute(old, [driven.exo], [exo])
    recurrence = Recurrence(
        ca.vertcat(driven.state, u, slope), ca.vertcat(t, h, columns), driven.parameters,
        ca.vertcat(step, u + h * slope, slope), output, implicit=driven.implicit, residual=residual, guess=guess,
        scale=driven.scale, ahead=(*driven.ahead, AHEAD, AHEAD),
    )  # fmt: skip
    names = (*layout.states, "u", "du")
    return recurrence, VectorLayout(layout.parameters, names, layout.memory, layout.delay)


def force_with_error(effects: tuple[Effect, ...]) -> tuple[Recurrence, VectorLayout]:
    """As `force_driven`, with the force a state: states [x, v, memory..., u, du], the force moving by its slope du.

    For estimating the force along with the motion. No inputs, or with a delay its two `delay_columns`.
    """
    driven, layout = force_driven(effects)
    n = 2 if layout.delay else 0
    u, slope, t, h = (ca.SX.sym(name) for name in ("u", "slope", "t", "h"))
    columns, later = ca.SX.sym("columns", n), ca.SX.sym("later", n)
    inputs = ca.vertcat(u + h / 2 * slope, columns)
    at_end = ca.vertcat(u + h * slope, later)
    exo = ca.vertcat(t, h, inputs, at_end) if driven.ends else ca.vertcat(t, h, inputs)
    old: Expression = [driven.step, driven.output, driven.residual, driven.guess]
    step, output, residual, guess = ca.substitute(old, [driven.exo], [exo])
    recurrence = Recurrence(
        ca.vertcat(driven.state, u, slope),
        ca.vertcat(t, h, columns, later) if driven.ends else ca.vertcat(t, h, columns),
        driven.parameters, ca.vertcat(step, u + h * slope, slope), output,
        implicit=driven.implicit, residual=residual, guess=guess, scale=driven.scale, ends=driven.ends and n > 0,
    )  # fmt: skip
    names = (*layout.states, "u", "du")
    return recurrence, VectorLayout(layout.parameters, names, layout.memory, layout.delay)


def motion_driven(effects: tuple[Effect, ...]) -> tuple[Recurrence, VectorLayout]:
    """Motion in, force out: states [memory...], inputs x [m], v [m/s], a [m/s2] and a load [N], output the recorded
    actuating force [N].

    The load is the part of that force which effects on the input change and effects that grow with the load see: all of
    it for a drive, the force of the air where the rest is measured by a load cell. The motion is the stem's.
    """
    m = _Assembly(effects, imposed=True)
    t, h, now, later = ca.SX.sym("t"), ca.SX.sym("h"), ca.SX.sym("e", 4), ca.SX.sym("later", 4)
    at_now = Quantities(t, now[0], now[1], now[2], now[3], now[0], speed=now[1])
    at_end = Quantities(t + h / 2, later[0], later[1], later[2], later[3], later[0], speed=later[1])
    q, rate = m.sample(at_now)
    recurrence = m.recurrence(
        t, h, now, later,
        step=ca.vertcat(*m.memory(m.step(at_now, at_end, h).end)), output=m.force(q, m.held, rate) - (q.u - now[3]),
    )  # fmt: skip
    return recurrence, m.layout
