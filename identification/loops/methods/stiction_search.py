"""The search for S and J: a stiction element before a linear process, with the inner problem linear.

Jelali (2008) and Lee, Ren and Huang (2008) search S and J globally; the element is that of Kano et al. (2004). The
process is ARX: many past values of PV, which stand for noise and disturbances of any colour, and two of the valve
behind one of many delays, which integrating processes are, too.

Where a valve stood at the first sample is not known, and a valve whose OP hardly goes further than S never forgets it.
At an extreme of OP in its first cycle the valve has just moved that way: valves start there, at the highest and at the
lowest one, and the better one counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.loops.loop import ControlLoop, averaged, scale_of
from identification.loops.stiction_models import kano
from recordings import Array

PAST, DELAYS = 20, 13
"""Past values of PV; delays of the valve, in samples of the search."""
PER_CYCLE, LONGEST = 60, 6000
"""Samples a cycle that are enough for the moments of jumps, and samples in all: more are averaged, or left out."""
S_GRID = tuple(0.2 + 0.05 * k for k in range(43))
J_GRID = (0.0, 0.15, 0.3, 0.5, 0.75, 1.0)
"""S as multiples of OP's half range, J as a share of S. Where OP hardly goes further than S, little of S too much is a
valve that never moves: a coarser grid misses the peak."""
RIDGE = 1e-9
FINER, BEST = 3, 3
"""How often the neighbourhoods of the best pairs are searched again, each time with half the step; how many of them."""
DS, DJ = (grid.ravel() for grid in np.meshgrid((-1.0, 0.0, 1.0), (-2.0, -1.0, 0.0, 1.0, 2.0)))
"""That neighbourhood, in steps of S."""


@dataclass(frozen=True)
class StictionSearch:
    """The search over S and J. s, j (k,) : pairs, in the unit of OP; error (k,) : best squared error over delays and
    starts; linear : the same without the element; n : degrees of freedom of the errors; step : of
    the finest grid of S.
    """

    s: Array
    j: Array
    error: Array
    linear: float
    n: int
    step: float

    @property
    def gain(self) -> float:
        """Twice the logarithm of the likelihood of the best pair over that of the linear process alone."""
        return self.n * float(np.log(self.linear / self.error.min()))

    @property
    def jump_gain(self) -> float:
        """Twice the logarithm of the likelihood of the best pair over that of the best backlash (J = 0)."""
        return self.n * float(np.log(self.error[self.j == 0].min() / self.error.min()))


def search(loop: ControlLoop, period: float | None) -> StictionSearch:
    """Every pair of the grid, and finer ones near the best. period : of the oscillation [samples], None without one."""
    every = max(1, round(period / PER_CYCLE)) if period else 1
    ready = _Ready.of(loop, every, period)
    reach = float(np.quantile(ready.op, 0.97) - np.quantile(ready.op, 0.03)) / 2
    s, share = (grid.ravel() for grid in np.meshgrid(S_GRID, J_GRID))
    s = s * reach
    j = s * share
    linear, error = ready.errors(s, j)
    step = (S_GRID[1] - S_GRID[0]) * reach
    for _ in range(FINER):
        step /= 2
        more_s, more_j = _near(s, j, error, step)
        _, more = ready.errors(more_s, more_j)
        s, j, error = (np.concatenate(pair) for pair in ((s, more_s), (j, more_j), (error, more)))
    return StictionSearch(s, j, error, linear, ready.n, step)


def _near(s: Array, j: Array, error: Array, step: float) -> tuple[Array, Array]:
    """Pairs around the best ones that are not neighbours, and on both sides of the best backlash."""
    left, plain = error.copy(), np.flatnonzero(j == 0)
    backlash = s[plain[np.argmin(error[plain])]]
    near_s, near_j = [backlash + step * np.array([-1.0, 1.0])], [np.zeros(2)]
    for _ in range(BEST):
        best = int(np.argmin(left))
        near_s.append(s[best] + step * DS)
        near_j.append(j[best] + step * DJ)
        left[(np.abs(s - s[best]) < 1.5 * step) & (np.abs(j - j[best]) < 3 * step)] = np.inf
    found = np.maximum(np.concatenate(near_s), step)
    return found, np.clip(np.concatenate(near_j), 0.0, found)


@dataclass(frozen=True)
class _Ready:
    """OP (n,) in its unit; every : samples that are averaged; high, low : where the valves start; y (m,), past (m, p) :
    what is predicted and an orthonormal basis of what it is predicted from beside the valve; y without its part in it.
    """

    op: Array
    every: int
    high: int
    low: int
    y: Array
    past: Array

    @classmethod
    def of(cls, loop: ControlLoop, every: int, period: float | None) -> _Ready:
        op, pv = loop.op[: LONGEST * every], loop.pv[: LONGEST * every]
        window = min(int(1.2 * period) if period else len(op), len(op) // 4)
        high, low = int(np.argmax(op[:window])), int(np.argmin(op[:window]))
        pv = averaged(((pv - pv.mean()) / scale_of(pv))[max(high, low) :], every)
        y = pv[PAST:]
        past, _ = np.linalg.qr(
            np.column_stack([*(pv[PAST - k : len(pv) - k] for k in range(1, PAST + 1)), np.ones(len(y))])
        )
        return cls(op, every, high, low, y - past @ (past.T @ y), past)

    @property
    def n(self) -> int:
        return max(1, len(self.y) - self.past.shape[1] - 2)

    def errors(self, s: Array, j: Array) -> tuple[float, Array]:
        """Squared error of the linear process, and those of the pairs (k,), each with its best delay and start."""
        first, scale = max(self.high, self.low), scale_of(self.op)
        up = kano(self.op[self.high :], s, j, 1.0)[first - self.high :]
        down = kano(self.op[self.low :], s, j, -1.0)[first - self.low :]
        valves = averaged(np.column_stack([self.op[first:], up, down]) - self.op.mean(), self.every) / scale
        found = np.maximum(float(self.y @ self.y) - self._explained(valves), 1e-12)
        return float(found[0]), np.minimum(found[1 : len(s) + 1], found[len(s) + 1 :])

    def _explained(self, valves: Array) -> Array:
        """Sum of squares (k,) that two neighbouring past values of each valve (m, k) explain, at its best delay."""
        most, one = np.zeros(valves.shape[1]), self._left(valves, 1)
        size, gift = _squares(one), self.y @ one
        for delay in range(1, DELAYS + 1):
            two = self._left(valves, delay + 1)
            other, more, across = _squares(two), self.y @ two, np.einsum("ij,ij->j", one, two)
            explained = (other * gift**2 - 2 * across * gift * more + size * more**2) / (size * other - across**2)
            most = np.maximum(most, explained)
            one, size, gift = two, other, more
        return most

    def _left(self, valves: Array, lag: int) -> Array:
        """Valves `lag` samples earlier, (n, k), without their part in the past: OP itself is nearly all in it."""
        earlier = valves[PAST - lag : len(valves) - lag]
        return np.asarray(earlier - self.past @ (self.past.T @ earlier), float)


def _squares(values: Array) -> Array:
    """Sums of squares (k,) with a ridge: one sample of the output of a PI controller follows from the one before."""
    return np.asarray((1 + RIDGE) * np.einsum("ij,ij->j", values, values) + RIDGE, float)
