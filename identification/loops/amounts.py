"""How much stiction: S and J with intervals, from the search of the Hammerstein model.

The likelihood of so sharp a model says little of how far S and J are off: a stem is no stiction element, and a pair
that is a little off sticks at other moments. So the truth is drawn about what was found by the errors of the simulated
sticky loops of the calibration, and those in which the search gained as much count most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.loops.calibration import ERRORS
from identification.loops.methods import StictionSearch
from identification.standard_tests import LEVEL, Interval
from recordings import Array

ALIKE = 0.7
"""Searches whose gains differ by this factor's exponential count as alike, standard deviation of the logarithm."""


@dataclass(frozen=True)
class PossibleValves:
    """Valves that a loop may have. s, j (k,) : in the unit of OP; gain (k,) : of the process over what was found, NaN
    where a level was calibrated; weight (k,) : they add to 1.
    """

    s: Array
    j: Array
    gain: Array
    weight: Array

    def interval(self, values: Array, best: float) -> Interval:
        """The interval of one of their quantities (k,), about the best value."""
        known = np.isfinite(values)
        values, weight = values[known], self.weight[known]
        order = np.argsort(values)
        middle = np.cumsum(weight[order]) / weight.sum()
        low, high = values[order][np.searchsorted(middle, ((1 - LEVEL) / 2, (1 + LEVEL) / 2))]
        return Interval(best, min(float(low), best), max(float(high), best))


@dataclass(frozen=True)
class StictionAmount:
    """s, j : in the unit of OP; total, rest : S + J and S - J, whose intervals are narrower than those of both."""

    s: Interval
    j: Interval
    total: Interval
    rest: Interval
    possible: PossibleValves


def amounts(found: StictionSearch) -> StictionAmount:
    """S and J of the best pair, with intervals."""
    s, j = found.best
    gain, off_s, off_j, off_gain = np.array(ERRORS).T
    valves = np.maximum(s * (1 + off_s), 0.0)
    jumps = np.clip(j + s * off_j, 0.0, valves)
    weight = np.exp(-0.5 * ((np.log(max(found.gain, 1.0)) - gain) / ALIKE) ** 2) + 1e-3
    possible = PossibleValves(valves, jumps, np.exp(off_gain), weight / weight.sum())
    return StictionAmount(
        possible.interval(valves, s), possible.interval(jumps, j), possible.interval(valves + jumps, s + j),
        possible.interval(valves - jumps, s - j), possible,
    )  # fmt: skip


def error_of(found: StictionSearch, s: float, j: float, gain_ratio: float) -> Array:
    """A row (4,) of `ERRORS`: logarithm of the gain of the search, errors of S and J over the S that was found, and the
    logarithm of the true process gain over the found one."""
    best_s, best_j = found.best
    offs = (np.log(max(found.gain, 1.0)), (s - best_s) / best_s, (j - best_j) / best_s)
    return np.array([*offs, np.log(gain_ratio) if gain_ratio > 0 else np.nan])
