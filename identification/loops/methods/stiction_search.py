"""The search for S and J: a stiction element before a linear process, with the inner problem linear.

Jelali (2008) and Lee, Ren and Huang (2008) search S and J globally; the elements are those of Kano and of He
(`sticking.models`), and the process is that of `valve_regression`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.loops.loop import ControlLoop
from identification.loops.methods.hammerstein_fit import FEW, MANY, HammersteinFit, half_range
from recordings import Array

S_GRID = (*(0.2 + 0.1 * k for k in range(8)), *(1.0 + 0.05 * k for k in range(27)))
J_GRID = (0.0, 0.15, 0.3, 0.5, 0.7, 0.85, 1.0)
"""S as multiples of OP's half range, J as a share of S. Where OP hardly goes further than S, little of S too much is a
valve that never moves: a coarser grid misses the peak."""
FINER, BEST = 2, 3
"""How often the neighbourhoods of the best pairs are searched again, each time with half the step; how many of them."""
DS, DJ = (grid.ravel() for grid in np.meshgrid((-1.0, 0.0, 1.0), (-2.0, -1.0, 0.0, 1.0, 2.0)))
"""That neighbourhood, in steps of S."""


@dataclass(frozen=True)
class StictionSearch:
    """The search over S and J. s, j (k,) : pairs, in the unit of OP; error (k,) : best squared error over elements,
    delays and starts; linear : the same without an element; n : degrees of freedom of the errors; reach : half
    the range of OP; beyond : twice the logarithm of the likelihood of the best pair over that
    of a linear process of high order.
    """

    s: Array
    j: Array
    error: Array
    linear: float
    n: int
    reach: float
    beyond: float

    @property
    def best(self) -> tuple[float, float]:
        """S and J of the best pair."""
        i = int(np.argmin(self.error))
        return float(self.s[i]), float(self.j[i])

    @property
    def gain(self) -> float:
        """Twice the logarithm of the likelihood of the best pair over that of a linear process of low order."""
        return self.n * float(np.log(self.linear / self.error.min()))

    @property
    def jump_gain(self) -> float:
        """Twice the logarithm of the likelihood of the best pair over that of the best backlash (J = 0)."""
        return self.n * float(np.log(self.error[self.j == 0].min() / self.error.min()))

    @property
    def width(self) -> float:
        """S of the best pair over half the range of OP: a valve that makes its loop swing has one to two."""
        return self.best[0] / self.reach


def search(loop: ControlLoop, period: float | None) -> StictionSearch:
    """Every pair of the grid, and finer ones near the best. period : of the oscillation [samples], None without one."""
    ready = HammersteinFit.of(loop, period)
    reach = half_range(ready.op)
    s, share = (grid.ravel() for grid in np.meshgrid(S_GRID, J_GRID))
    s = s * reach
    j = s * share
    error = ready.errors(s, j, FEW)
    step = (S_GRID[-1] - S_GRID[-2]) * reach
    for _ in range(FINER):
        step /= 2
        more_s, more_j = _near(s, j, error, step)
        more = ready.errors(more_s, more_j, MANY)
        s, j, error = (np.concatenate(pair) for pair in ((s, more_s), (j, more_j), (error, more)))
    best = np.argmin(error)
    beyond = ready.beyond(float(s[best]), float(j[best]))
    return StictionSearch(s, j, error, ready.linear, ready.process.n, reach, beyond)


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
