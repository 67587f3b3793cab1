"""How much stiction: S and J with intervals, from the search of the Hammerstein model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from identification.loops.methods import StictionSearch
from identification.standard_tests import Interval
from recordings import Array

WIDENED = 100.0
"""The likelihood region is wider by this factor than that of a perfect model with white noise. With it the intervals
covered S and J in nine of ten of the simulated sticky loops of the calibration seeds; without it in half of them.
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
    worse = found.n * np.log(found.error / found.error.min())
    inside = worse <= WIDENED * float(chi2.ppf(0.95, 2))
    best = int(np.argmin(found.error))
    s_step, j_step = _half_steps(found, best)
    return StictionAmount(
        _interval(found.s, inside, best, s_step),
        _interval(found.j, inside, best, j_step),
        _interval(found.s + found.j, inside, best, s_step),
        _interval(found.s - found.j, inside, best, s_step),
    )


def _half_steps(found: StictionSearch, best: int) -> tuple[float, float]:
    """Half the distance of neighbours in the grid at the best pair: no interval is narrower."""
    s = np.unique(found.s)
    j = np.unique(found.j[found.s == found.s[best]])
    return float(np.min(np.diff(s))) / 2, float(np.max(np.diff(j))) / 2


def _interval(values: Array, inside: NDArray[np.bool_], best: int, step: float) -> Interval:
    low, high = float(values[inside].min()) - step, float(values[inside].max()) + step
    return Interval(float(values[best]), max(0.0, low), high)
