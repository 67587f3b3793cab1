"""The force of the diaphragm in the past, for an effect with a dead time on the stem of the actuator.

It is kept at the start of every step and is linear between: the chamber is far slower than that.
"""

from __future__ import annotations

import math

import casadi as ca

from simulator.compile.step import VectorLayout
from simulator.damadics.actuator.parameters import STEP
from simulator.effect import Expression

Expressions = list[Expression]
LONGEST = 0.1
"""Longest dead time in the actuator [s]: each step of it is a state."""


def names(layout: VectorLayout) -> tuple[str, ...]:
    """Names of the states that hold the force at the start of the last steps, newest first; none without a delay."""
    count = math.ceil(LONGEST / STEP) + 1
    return tuple(f"push{i}" for i in range(1, count + 1)) if layout.delay else ()


def kept(t: Expression, now: Expression, past: Expressions, substep: float) -> Expressions:
    """The states after the sub-step around the time t [s]; now : the force at its start."""
    first = _since(t, substep) == 0
    return [ca.if_else(first, newer, held) for newer, held in zip([now, *past], past, strict=False)]


def earlier(
    t: Expression, now: Expression, then: Expression, way: float, past: Expressions, delay: Expression, substep: float
) -> Expression:
    """The force a delay [s] before the moment `way` [s] into the sub-step around t, at which it is `then`."""
    since, age = _since(t, substep), delay - way
    newest = ca.if_else(since == 0, STEP, since)
    before = sum(held * ca.fmax(0.0, 1 - ca.fabs((age - newest) / STEP - i)) for i, held in enumerate(past))
    recent = ca.if_else(age < newest, now + (past[0] - now) * age / newest, before)
    return ca.if_else(age < 0, now + (then - now) * (way - delay) / way, recent)


def _since(t: Expression, substep: float) -> Expression:
    """Time from the start of the step to that of its sub-step around t [s]."""
    index, whole = ca.floor(t / substep), round(STEP / substep)
    return substep * (index - whole * ca.floor((index + 0.5) / whole))
