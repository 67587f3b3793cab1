"""A measured quantity with its interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

LEVEL = 0.95
"""Coverage of every interval of a valve test."""


@dataclass(frozen=True)
class Interval:
    """A value and the interval that covers the truth with probability `LEVEL`; the unit is the end of its name."""

    value: float
    lower: float
    upper: float

    @classmethod
    def about(cls, value: float, std: float) -> Interval:
        """The interval of a value with normal error of this standard deviation."""
        half = 1.96 * std
        return cls(value, value - half, value + half)

    @classmethod
    def of_repeats(cls, values: Sequence[float], within: float = 0.0) -> Interval:
        """The mean of repeated values; `within` : standard deviation that every one of them has in common."""
        mean, n = float(np.mean(values)), len(values)
        if n < 2:
            return cls.about(mean, within)
        half = float(student.ppf(0.5 + LEVEL / 2, n - 1) * np.std(values, ddof=1) / np.sqrt(n))
        half = float(np.hypot(half, 1.96 * within))
        return cls(mean, mean - half, mean + half)

    def scaled(self, factor: float) -> Interval:
        """The same in another unit."""
        low, high = sorted((self.lower * factor, self.upper * factor))
        return Interval(self.value * factor, low, high)

    def as_json(self) -> dict[str, float]:
        """As `test.json` and `assessment.json` have it."""
        return {"value": self.value, "lower": self.lower, "upper": self.upper}
