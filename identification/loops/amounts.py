"""How much stiction: S and J with intervals, from the search of the Hammerstein model.

The likelihood of so sharp a model says little of how far S and J are off: a stem is no stiction element, and a pair
that is a little off sticks at other moments. So the truth is drawn about what was found by the errors of the simulated
sticky loops of the calibration, and those in which the search gained as much count most.

A stem on its spring slides to rest where an element stands at once, so its J comes out too small. Where forces are
asked for, the valve is such a stem, and the errors are those of stems alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.loops.calibration import ERRORS, STEM_ERRORS
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

    def median(self, values: Array) -> float:
        """The middle one of the values (k,) of one of their quantities."""
        return self._at(values, (0.5,))[0]

    def interval(self, values: Array, best: float) -> Interval:
        """The interval of one of their quantities (k,), about the best value."""
        low, high = self._at(values, ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
        return Interval(best, min(low, best), max(high, best))

    def _at(self, values: Array, shares: tuple[float, ...]) -> list[float]:
        """The values below which these shares of the weight lie."""
        known = np.isfinite(values)
        values, weight = values[known], self.weight[known]
        order = np.argsort(values)
        middle = np.cumsum(weight[order]) / weight.sum()
        places = np.minimum(np.searchsorted(middle, shares), len(order) - 1)
        return [float(value) for value in values[order][places]]


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
    return _about(_possible(found, ERRORS), s, j, s + j, s - j)


def stem_amounts(found: StictionSearch) -> StictionAmount:
    """S and J as they follow from the friction of a stem on its spring, with intervals: the middle of what stems have
    in which the search found such a pair."""
    possible = _possible(found, STEM_ERRORS)
    s, j = possible.s, possible.j
    return _about(possible, *(possible.median(values) for values in (s, j, s + j, s - j)))


def _possible(found: StictionSearch, errors: Sequence[tuple[float, float, float, float]]) -> PossibleValves:
    s, j = found.best
    gain, off_s, off_j, off_gain = np.array(errors).T
    valves = np.maximum(s * (1 + off_s), 0.0)
    jumps = np.clip(j + s * off_j, 0.0, valves)
    weight = np.exp(-0.5 * ((np.log(max(found.gain, 1.0)) - gain) / ALIKE) ** 2) + 1e-3
    return PossibleValves(valves, jumps, np.exp(off_gain), weight / weight.sum())


def _about(possible: PossibleValves, s: float, j: float, total: float, rest: float) -> StictionAmount:
    one = possible.interval
    return StictionAmount(
        one(possible.s, s), one(possible.j, j), one(possible.s + possible.j, total), one(possible.s - possible.j, rest),
        possible,
    )  # fmt: skip


def error_of(found: StictionSearch, s: float, j: float, gain_ratio: float) -> Array:
    """A row (4,) of `ERRORS`: logarithm of the gain of the search, errors of S and J over the S that was found, and the
    logarithm of the true process gain over the found one."""
    best_s, best_j = found.best
    offs = (np.log(max(found.gain, 1.0)), (s - best_s) / best_s, (j - best_j) / best_s)
    return np.array([*offs, np.log(gain_ratio) if gain_ratio > 0 else np.nan])
