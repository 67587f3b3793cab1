"""How much stiction: S and J with intervals, from the search of the Hammerstein model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from identification.loops.methods import StictionSearch
from identification.standard_tests import Interval
from recordings import Array

WIDENED_S, WIDENED_J = 32.0, 100.0
"""The likelihood region is wider by these factors than that of a perfect model with white noise, for S, and for what
has J in it. With them the intervals covered S and J in nine of ten of the simulated sticky loops of the calibration
seeds; without them S in three quarters and J in one quarter: the size of the jump and the gain of the process trade.
"""


@dataclass(frozen=True)
class StictionAmount:
    """s, j : in the unit of OP; total, rest : S + J and S - J, whose intervals are narrower than those of both."""

    s: Interval
    j: Interval
    total: Interval
    rest: Interval


def amounts(found: StictionSearch) -> StictionAmount:
    """S and J of the best pair, and the smallest and largest of the pairs that the data do not tell from it."""
    worse = found.n * np.log(found.error / found.error.min()) / float(chi2.ppf(0.95, 2))
    best, near, far = int(np.argmin(found.error)), worse <= WIDENED_S, worse <= WIDENED_J
    return StictionAmount(
        _interval(found.s, near, best, found.step),
        _interval(found.j, far, best, found.step),
        _interval(found.s + found.j, far, best, found.step),
        _interval(found.s - found.j, far, best, found.step),
    )


def _interval(values: Array, inside: NDArray[np.bool_], best: int, step: float) -> Interval:
    """No interval is narrower than the grid."""
    low, high = float(values[inside].min()) - step, float(values[inside].max()) + step
    return Interval(float(values[best]), max(0.0, low), high)
