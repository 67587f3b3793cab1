"""A pressure that should stay where it was while the detector was learned."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from detector.measurements import Measurement, Measurements

TOLERANCE = 0.1
"""A pressure may leave the range it was learned in by this share of its level, and by a quarter of that range."""

_LIMIT, _OVERFLOW = 3.0, 2.0
"""Limit of the sum of departures, and how many times the limit it may reach."""


@dataclass(frozen=True)
class PressureLevel:
    """The range of a pressure. middle, half : learned range, widened, in its unit."""

    signal: str
    middle: float
    half: float

    def step(self, sum_before: float, moment: Measurement) -> float:
        """The sum of departures from the range; an alarm above `_LIMIT`."""
        value = moment.values[self.signal]
        if not isfinite(value):
            return sum_before
        away = (abs(value - self.middle) - self.half) / max(TOLERANCE * abs(self.middle), 1e-300)
        return min(max(sum_before + min(4.0 * away, 2.0), 0.0), _OVERFLOW * _LIMIT)

    def score(self, total: float) -> float:
        """Above 1 means alarm."""
        return total / _LIMIT


def learned_level(data: Measurements, signal: str) -> PressureLevel | None:
    """The range of a pressure on fault-free data; None when it is not measured."""
    if signal not in data:
        return None
    low, high = np.nanquantile(data.values[signal], (0.001, 0.999))
    middle = float(low + high) / 2
    return PressureLevel(signal, middle, 0.625 * float(high - low) + TOLERANCE * abs(middle))
