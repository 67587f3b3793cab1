"""Backlash-like hysteresis without corners (equation 2.38-2.43)."""

from __future__ import annotations

import math

from recordings import BadParameter


class SmoothBacklash:
    """w of (2.39), dw = alpha abs(dv) (c v - w) + B1 dv, by its solution (2.40, 2.41) for one-way moves of v.

    c v - w comes to rest at +-(c - B1)/alpha (2.42, 2.43), the backlash distance times c. alpha : rate of the
    transition; c : slope of the lines; b1 : slope in the middle, b1 < c; start : first v and w.
    Raises BadParameter for values that are no backlash.

    >>> smooth = SmoothBacklash(alpha=1.0, c=3.0, b1=1.0)
    >>> smooth.update(40.0) - 3.0 * 40.0
    -2.0
    """

    def __init__(self, alpha: float, c: float, b1: float, start: tuple[float, float] = (0.0, 0.0)) -> None:
        if not 0 < alpha < math.inf:
            raise BadParameter("alpha", f"{alpha:g}", "it is not a positive number", "alpha > 0")
        if not -math.inf < b1 < c < math.inf:
            raise BadParameter("c", f"{c:g}", f"it is not above b1, {b1:g}", "c > B1")
        self._alpha, self._c, self._limit = alpha, c, (c - b1) / alpha
        self._input, self.output = start

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value."""
        moved = value - self._input
        ahead = self.output - self._c * self._input  # d(v) of (2.40)
        settled = -math.copysign(self._limit, moved)
        ahead = settled + (ahead - settled) * math.exp(-self._alpha * abs(moved))
        self._input, self.output = value, self._c * value + ahead
        return self.output
