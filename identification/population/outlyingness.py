"""Which valves are unlike the others of their fleet, at a stated false-discovery rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from recordings import Array

LEAST = 8
"""With fewer valves there is no distribution to be an outlier of."""

EFFICIENCY = 0.37
"""Of the median absolute deviation against the standard deviation, for a normal distribution: what it knows of the
spread of n values is what the standard deviation knows of 0.37 n."""

NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


@dataclass(frozen=True)
class Outlyingness:
    """How far each of n valves is from the middle of the fleet.

    score : in spreads, shape (n,), NaN where there is no value; q : the smallest false-discovery rate at which the
    valve is told (Benjamini-Hochberg), shape (n,); told : those at the rate that was asked for, shape (n,);
    middle, spread : of the fleet, without the errors of the estimates.
    """

    score: Array
    q: Array
    told: NDArray[np.bool_]
    middle: float
    spread: float


def outliers(values: Array, errors: Array, rate: float = 0.05) -> Outlyingness:
    """Outliers against the fleet's own distribution.

    Parameters
    ----------
    values : array, shape (n,)
        An estimate for each valve, on a scale where sound valves are about normal: logarithms for friction.
        NaN where there is none.
    errors : array, shape (n,)
        Its standard error, 0 where it is not known. A valve that is badly known is not an outlier for that.
    rate : float, optional
        Expected share of sound valves among those that are told, at most.

    Notes
    -----
    Middle and spread are median and median absolute deviation, which a third of odd valves do not move far. What the
    errors explain of the spread is taken out of it, and put back for each valve by its own error. Scores are compared
    with Student's distribution, because the spread itself is estimated, and the p values go through Benjamini and
    Hochberg's procedure (1995), which holds the rate also for values that depend on the same middle and spread, about.
    """
    known = np.isfinite(values)
    score, q = np.full(len(values), np.nan), np.full(len(values), np.nan)
    if known.sum() < LEAST:
        return Outlyingness(score, q, np.zeros(len(values), bool), float("nan"), float("nan"))
    there, known_errors = values[known], np.nan_to_num(errors[known])
    middle = float(np.median(there))
    seen = (NORMAL * float(np.median(np.abs(there - middle)))) ** 2
    spread = float(np.sqrt(max(seen - float(np.median(known_errors**2)), 0.0)))
    # The spread is never less than rounding: values that are all equal have no outliers by a last digit.
    scale = np.sqrt(spread**2 + known_errors**2 + (1e-9 * max(abs(middle), 1e-300)) ** 2)
    score[known] = (there - middle) / scale
    p = 2.0 * stats.t.sf(np.abs(score[known]), max(EFFICIENCY * known.sum(), 1.0))
    q[known] = stats.false_discovery_control(p, method="bh")
    return Outlyingness(score, q, np.nan_to_num(q, nan=1.0) <= rate, middle, spread)
