"""What changes in one valve from recording to recording: its trend, and the change from the first to the last."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from recordings import Array

YEAR_S = 365.25 * 86400.0


@dataclass(frozen=True)
class Trend:
    """A straight line over the years. slope : a year; std : its standard error; p : of no trend at all."""

    slope: float
    std: float
    p: float


@dataclass(frozen=True)
class EstimateChange:
    """From the first to the last estimate. value; std : its standard error; p : of no change at all."""

    value: float
    std: float
    p: float


def trend(at_s: Array, values: Array, errors: Array) -> Trend | None:
    """The trend of estimates over time; None for less than three, or where all are of one time.

    at_s : times [s], shape (n,); values, errors : estimates and standard errors, shape (n,). Weighted least squares;
    where the estimates differ by more than their errors say, the error of the slope grows with it (Birge's ratio).
    """
    if len(values) < 3 or np.ptp(at_s) <= 0.0:
        return None
    years, weights = (at_s - at_s.mean()) / YEAR_S, 1.0 / errors**2
    middle = float(weights @ years / weights.sum())
    across = years - middle
    slope = float(weights @ (across * values) / (weights @ across**2))
    level = float(weights @ values / weights.sum())
    misfit = float(weights @ (values - level - slope * across) ** 2) / (len(values) - 2)
    std = float(np.sqrt(max(misfit, 1.0) / (weights @ across**2)))
    return Trend(slope, std, float(2.0 * stats.t.sf(abs(slope) / std, len(values) - 2)))


def change(first: float, first_std: float, last: float, last_std: float) -> EstimateChange:
    """The change between two estimates."""
    std = float(np.hypot(first_std, last_std))
    score = abs(last - first) / std if std else float("inf")
    return EstimateChange(last - first, std, float(2.0 * stats.norm.sf(score)))
