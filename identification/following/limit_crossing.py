"""When a level crosses a limit, from what is believed of it: by simulation of its future."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.following.trend import INTERVAL, TrendBelief
from recordings import Array

DRAWN, STEPS = 4000, 400
FURTHEST = 3653.0
"""Days that are looked ahead."""
SEED = 20


@dataclass(frozen=True)
class LimitCrossing:
    """limit : in the unit of the quantity; probability : that it is crossed within `FURTHEST` days; days : median and
    ends of the 95 % interval, from the last recording on, None where that much is not certain; crossed : the level is
    beyond the limit already, on the side away from where it began.
    """

    limit: float
    probability: float
    days: tuple[float | None, float | None, float | None]
    crossed: bool


def crossing(belief: TrendBelief, limit: float, started: float) -> LimitCrossing:
    """When the level crosses a limit. started : the level of the first recording, on the good side."""
    rng = np.random.default_rng(SEED)
    level, slope, wander = belief.drawn(DRAWN, rng)
    side = 1.0 if limit >= started else -1.0
    beyond = side * (level - limit) >= 0
    if float(np.mean(beyond)) > 0.5:
        return LimitCrossing(limit, 1.0, (0.0, 0.0, 0.0), True)
    days = np.concatenate([[0.0], np.geomspace(0.1, FURTHEST, STEPS)])
    first = np.where(beyond, 0.0, np.inf)
    for before, day in pairwise(days.tolist()):
        level = level + slope * (day - before) + wander * np.sqrt(day - before) * rng.normal(size=DRAWN)
        first = np.where(np.isinf(first) & (side * (level - limit) >= 0), day, first)
    return LimitCrossing(limit, float(np.mean(np.isfinite(first))), _days(first), False)


def _days(first: Array) -> tuple[float | None, float | None, float | None]:
    """Median and both ends of the interval; None where so many have not crossed in the time looked at."""
    median, low, high = np.quantile(first, (0.5, *INTERVAL), method="higher")
    return tuple(float(one) if np.isfinite(one) else None for one in (median, low, high))  # type: ignore[return-value]
