"""A stiction element before a linear process, fitted to a loop: squared errors of pairs of S and J.

Where a valve stood at the first sample is not known, and one whose OP hardly goes further than S never forgets it: so
every start is tried. It rested somewhere between its two break-aways, or it moved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.loops.loop import ControlLoop, averaged, scale_of
from identification.loops.methods.valve_regression import FIRST, PAST, ValveRegression
from identification.loops.sticking.models import MOVES_DOWN, MOVES_UP, sticking
from recordings import Array

PER_CYCLE, LONGEST = 200, 6000
"""Samples a cycle that are enough for the moments of jumps, and samples in all: more are averaged, or left out."""
FEW, MANY = ((MOVES_DOWN, *((2 * k + 1 - n) / n for k in range(n)), MOVES_UP) for n in (8, 16))
"""Starts of a valve, as of `sticking`, for all pairs and for those near the best."""
AT_ONCE = 400_000
"""Places of valves in memory together."""


@dataclass(frozen=True)
class HammersteinFit:
    """op (n,) : in its unit; every : samples that are averaged; process : of PV; high_order : the same beside past
    values of OP; linear : squared error with OP as the valve."""

    op: Array
    every: int
    process: ValveRegression
    high_order: ValveRegression
    linear: float

    @classmethod
    def of(cls, loop: ControlLoop, period: float | None) -> HammersteinFit:
        """For a loop whose oscillation has this period [samples], None where there is none."""
        every = max(1, round(period / PER_CYCLE)) if period else 1
        every = min(every, max(1, len(loop.pv) // (4 * (FIRST + PAST))))  # enough samples are left
        op, pv = loop.op[: LONGEST * every], loop.pv[: LONGEST * every]
        shown, valve = averaged((pv - pv.mean()) / scale_of(pv), every), _scaled(op[None], op, every)
        process = ValveRegression.of(shown)
        return cls(op, every, process, ValveRegression.of(shown, valve[0]), float(process.errors(valve)[0]))

    def errors(self, s: Array, j: Array, starts: tuple[float, ...]) -> Array:
        """Squared errors of the pairs (k,), each with its best element, delay and start."""
        together = max(1, AT_ONCE // (len(self.op) * len(starts)))
        parts = [slice(k, k + together) for k in range(0, len(s), together)]
        each = [self._each(self.process, s[part], j[part], np.array(starts)) for part in parts]
        return np.asarray(np.concatenate([one.min(axis=(0, 2)) for one in each]), float)

    def beyond(self, s: float, j: float) -> float:
        """Twice the logarithm of the likelihood with a pair over that of a linear process of high order."""
        error = self._each(self.high_order, np.array([s]), np.array([j]), np.array(MANY)).min()
        return self.high_order.n * float(np.log(self.high_order.left / error))

    def told_by(self, place: Array) -> tuple[float, float]:
        """How far the best of all methods could tell a valve of known places (n,), in the unit of OP: twice the
        logarithm of the likelihood with it over that of a linear process of high order, and over that of backlash."""
        valve = _scaled(place[None, : len(self.op)], self.op, self.every)
        s = np.geomspace(0.02, 2.5, 60) * half_range(self.op)
        backlash = self.errors(s, np.zeros(len(s)), MANY).min()
        linear = self.high_order.n * float(np.log(self.high_order.left / self.high_order.errors(valve)[0]))
        return linear, self.process.n * float(np.log(backlash / self.process.errors(valve)[0]))

    def course(self, s: float, j: float) -> Array:
        """The valve (n,) of a pair with the best element and start, about the mean of OP, in its deviations."""
        pair = np.array([s]), np.array([j])
        element, _, start = np.unravel_index(
            int(np.argmin(found := self._each(self.process, *pair, np.array(MANY)))), found.shape
        )
        return _scaled(sticking(self.op, *pair, np.array([MANY[start]]), bool(element)), self.op, self.every)[0]

    def _each(self, process: ValveRegression, s: Array, j: Array, starts: Array) -> Array:
        """Squared errors (2, k, n_starts): elements of Kano and of He, pairs, starts."""
        each = (np.repeat(s, len(starts)), np.repeat(j, len(starts)), np.tile(starts, len(s)))
        found = [
            process.errors(_scaled(sticking(self.op, *each, rests), self.op, self.every)).reshape(len(s), -1)
            for rests in (False, True)
        ]
        return np.stack(found)


def half_range(op: Array) -> float:
    """Half of what OP (n,) goes over, but for its rarest values."""
    return float(np.quantile(op, 0.97) - np.quantile(op, 0.03)) / 2


def _scaled(valves: Array, op: Array, every: int) -> Array:
    """Valves (k, n) about the mean of OP, in its standard deviations, averaged."""
    return np.ascontiguousarray(averaged(valves.T - op.mean(), every).T) / scale_of(op)
