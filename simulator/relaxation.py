"""Laws of memory states, and how a step integrates them exactly, however stiff they are.

Both laws are linear in their state while everything else keeps its mean over the step, so the state has a closed
form. It is written with phi1(y) = (1 - exp(-y))/y and phi2(y) = (1 - phi1(y))/y, y being the step times the rate
(Hochbruck and Ostermann, "Exponential integrators", Acta Numerica 19, 2010, section 2, up to the sign of y).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

Expression = Any
"""A CasADi SX scalar expression, or a number."""


class Course(NamedTuple):
    """What a memory state does in a step: its mean, its mean rate of change [unit/s] and its end value."""

    mean: Expression
    rate: Expression
    end: Expression


class Law(ABC):
    """How a memory state evolves; the kernel asks for its law at the middle and at the end of every step."""

    @abstractmethod
    def over(self, s: Expression, h: Expression, at_end: Law) -> Course:
        """The course of a state that starts at `s` over a step h [s], given the same law at the end of the step."""

    @abstractmethod
    def implicit(self, s: Expression, h: Expression) -> Expression:
        """The state after a backward Euler step h [s] from `s`, this law holding at its end."""

    @abstractmethod
    def now(self, s: Expression) -> Expression:
        """The rate of change of a state `s` at an instant [unit/s]."""


@dataclass(frozen=True)
class Relaxation(Law):
    """The law ds/dt = drive - rate * s of a memory state, with rate >= 0 [1/s] and drive [unit/s].

    Drive and rate keep their value at mid-step: right for bristles, whose equilibrium hardly moves in a step. A state
    that has to follow a moving target closely is a `Lag`.
    """

    drive: Expression
    rate: Expression

    def over(self, s: Expression, h: Expression, at_end: Law) -> Course:
        """Exact for a constant drive and rate."""
        phi1, phi2 = _phi(self.rate * h)
        slope = self.drive - self.rate * s
        return Course(s + h * phi2 * slope, phi1 * slope, s + h * phi1 * slope)

    def implicit(self, s: Expression, h: Expression) -> Expression:
        """Linear in the state, so solved."""
        return (s + h * self.drive) / (1 + h * self.rate)

    def now(self, s: Expression) -> Expression:
        """The right-hand side of the law."""
        return self.drive - self.rate * s


@dataclass(frozen=True)
class Lag(Law):
    """The law tau ds/dt = target - s of a memory state that follows a target, tau >= 0 [s].

    The target moves linearly in time over a step, so the state is second-order accurate for every tau and *is* the
    target at tau = 0, where its derivative by tau is right as well.
    """

    target: Expression
    tau: Expression

    def over(self, s: Expression, h: Expression, at_end: Law) -> Course:
        """Exact for a target that moves linearly and a constant tau."""
        if not isinstance(at_end, Lag):
            raise TypeError("the law of a memory state is a Lag at mid-step and something else at its end")
        half = at_end.target - self.target
        decay, phi1, phi2 = _decay(self.tau / h)
        behind = s - (self.target - half)
        mean = self.target - 2 * half * phi2 + behind * phi1
        end = at_end.target - 2 * half * phi1 + behind * decay
        return Course(mean, (end - s) / h, end)

    def implicit(self, s: Expression, h: Expression) -> Expression:
        """Linear in the state, so solved; the target itself where tau is 0."""
        return (self.tau * s + h * self.target) / (self.tau + h)

    def now(self, s: Expression) -> Expression:
        """The right-hand side of the law, divided by tau; tau counts as 1 ns at least."""
        return (self.target - s) / ca.fmax(self.tau, 1e-9)


def _phi(y: Expression) -> tuple[Expression, Expression]:
    """phi1 and phi2 for y >= 0, by series where the formulas cancel."""
    small = y < 0.02
    safe = ca.if_else(small, 1.0, y)
    phi1 = -ca.expm1(-safe) / safe
    series1 = 1 - y / 2 * (1 - y / 3 * (1 - y / 4 * (1 - y / 5 * (1 - y / 6))))
    series2 = 0.5 * (1 - y / 3 * (1 - y / 4 * (1 - y / 5 * (1 - y / 6 * (1 - y / 7)))))
    return ca.if_else(small, series1, phi1), ca.if_else(small, series2, (1 - phi1) / safe)


def _decay(r: Expression) -> tuple[Expression, Expression, Expression]:
    """exp(-1/r), phi1(1/r) and phi2(1/r) for r >= 0, with their derivatives at r = 0."""
    fast = r < 0.02
    y = 1 / ca.if_else(fast, 1.0, r)
    phi1, phi2 = _phi(y)
    # exp(-50) and less is nothing beside 1: what is left of phi1 and phi2 are polynomials in r.
    return ca.if_else(fast, 0.0, ca.exp(-y)), ca.if_else(fast, r, phi1), ca.if_else(fast, r * (1 - r), phi2)
