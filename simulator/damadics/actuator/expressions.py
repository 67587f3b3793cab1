"""The few pieces that the block diagram of the benchmark is made of, as CasADi expressions."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca

from simulator.effect import Expression

Knots = tuple[tuple[float, float], ...]


def clip(x: Expression, lower: Expression, upper: Expression) -> Expression:
    """x limited to [lower, upper]."""
    return ca.if_else(x < lower, lower, ca.if_else(x > upper, upper, x))


def play(x: Expression, before: Expression, width: Expression) -> Expression:
    """Play (backlash) of a width around x: the output rests until an edge of the play takes it along."""
    low, high = x - width / 2, x + width / 2
    return ca.if_else(before < low, low, ca.if_else(before > high, high, before))


def table(x: Expression, knots: Knots) -> Expression:
    """Linear interpolation between knots (x, y), x rising; constant beyond the first and last.

    Written as a sum of bends: one comparison a knot, and no search.
    """
    slopes = [(y1 - y0) / (x1 - x0) for (x0, y0), (x1, y1) in pairwise(knots)]
    bends = [after - before for before, after in pairwise([0.0, *slopes, 0.0])]
    return knots[0][1] + sum(bend * _above(x - at) for (at, _), bend in zip(knots, bends, strict=True) if bend)


def root(x: Expression) -> Expression:
    """sqrt(abs(x)) with the sign of x: turbulent flow for either sign of the pressure difference."""
    return ca.sign(x) * ca.sqrt(ca.fabs(x))


def _above(x: Expression) -> Expression:
    return ca.if_else(x > 0, x, 0)
