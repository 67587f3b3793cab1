"""One quantity over months: the newest value with its interval, and a slope with its own."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hil.service.in_service.figures import Trended

if TYPE_CHECKING:
    from identification.standard_tests import Interval

MOST = 400
"""Values that are kept; when there are more, every second of the older half goes."""

FEWEST = 6
"""Values from which on there is a slope."""

DAY_S = 86400.0


class FigureValue(NamedTuple):
    """One value with its interval. at : POSIX [s]."""

    at: float
    value: float
    lower: float
    upper: float


def with_value(history: Sequence[FigureValue], new: FigureValue) -> tuple[FigureValue, ...]:
    """The history with one more value, thinned where it is old."""
    both = (*history, new)
    if len(both) <= MOST:
        return both
    half = MOST // 2
    return (*both[:half:2], *both[half:])


def trended(history: Sequence[FigureValue], unit: str) -> Trended | None:
    """The quantity as its history tells it; None for no history.

    The slope is that of ordinary least squares. Its interval comes from the scatter of the values about the line, so
    that what repeats badly has a wide one.
    """
    from identification.standard_tests import Interval  # see `figures`

    if not history:
        return None
    last = history[-1]
    now = Interval(last.value, last.lower, last.upper)
    return Trended(now, unit, _slope(history), len(history), datetime.fromtimestamp(last.at, UTC))


def _slope(history: Sequence[FigureValue]) -> Interval | None:
    from scipy.stats import t as student

    from identification.standard_tests import Interval

    days = np.array([one.at for one in history]) / DAY_S
    values = np.array([one.value for one in history])
    x = days - days.mean()
    power = float(np.sum(x**2))
    if len(history) < FEWEST or power <= 0.0:
        return None
    slope = float(np.sum(x * values) / power)
    rest = values - values.mean() - slope * x
    freedom = len(history) - 2
    error = float(np.sqrt(np.sum(rest**2) / freedom / power))
    half = float(student.ppf(0.975, freedom)) * error
    return Interval(slope, slope - half, slope + half)
