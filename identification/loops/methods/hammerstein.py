"""A stiction element before a linear process: how much better than the linear process alone, and with which S and J.

Jelali (2008) and Lee, Ren and Huang (2008) search S and J globally with the inner problem linear; the element is
that of Kano et al. (2004). The process is ARX of second order with one of several delays, which integrating ones are,
too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, judged
from identification.loops.stiction_models import kano
from recordings import Array

NAME = "hammerstein"
DELAYS = (0, 1, 2, 4, 8)
S_GRID = tuple(0.3 + 0.1 * k for k in range(19))
J_GRID = (0.0, 0.15, 0.3, 0.5, 0.75, 1.0)
"""S as multiples of OP's half range, J as a share of S."""


@dataclass(frozen=True)
class StictionSearch:
    """The search over S and J. s, j (k,) : pairs, in scaled OP; error (k,) : best squared error over the delays;
    linear : the same without the element; n : samples.
    """

    s: Array
    j: Array
    error: Array
    linear: float
    n: int

    @property
    def gain(self) -> float:
        """Logarithm of the linear error over that of the best pair."""
        return float(np.log(self.linear / self.error.min()))

    @property
    def jump_gain(self) -> float:
        """Logarithm of the error of the best backlash (J = 0) over that of the best pair."""
        return float(np.log(self.error[self.j == 0].min() / self.error.min()))


def search(loop: Cycles) -> StictionSearch:
    """Every pair of the grid."""
    reach = float(np.quantile(loop.op, 0.97) - np.quantile(loop.op, 0.03)) / 2
    s, share = (grid.ravel() for grid in np.meshgrid(S_GRID, J_GRID))
    s = s * reach
    valves = np.column_stack([loop.op, kano(loop.op, s, s * share)])
    errors = np.min([_errors(loop.pv, valves, delay) for delay in DELAYS], axis=0)
    return StictionSearch(s, s * share, np.maximum(errors[1:], 1e-12), max(float(errors[0]), 1e-12), len(loop.pv))


def _errors(pv: Array, valves: Array, delay: int) -> Array:
    """Squared errors (k,) of one-step predictions of pv (n,) by ARX(2, 2) from each of the valves (n, k)."""
    start = delay + 2
    y, past = pv[start:], np.column_stack([pv[start - 1 : -1], pv[start - 2 : -2], np.ones(len(pv) - start)])
    basis, _ = np.linalg.qr(past)
    one, two = valves[1 : len(valves) - delay], valves[: len(valves) - delay - 1]
    one, two = (each[-len(y) - 1 : -1] for each in (one, two))
    y = y - basis @ (basis.T @ y)
    one, two = (each - basis @ (basis.T @ each) for each in (one, two))
    a, b, c = (np.einsum("ij,ij->j", p, q) + w for p, q, w in ((one, one, 1e-9), (one, two, 0.0), (two, two, 1e-9)))
    u, v = y @ one, y @ two
    explained = (c * u**2 - 2 * b * u * v + a * v**2) / np.maximum(a * c - b**2, 1e-18)
    return np.asarray(y @ y - np.clip(explained, 0.0, None), float)


def hammerstein_answer(found: StictionSearch) -> MethodAnswer:
    """Index: logarithm of the error without the stiction element over that with it."""
    return judged(NAME, found.gain, 0.02, 0.1, "log ratio of the errors without and with stiction")
