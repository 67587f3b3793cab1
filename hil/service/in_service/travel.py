"""How much a valve travels: time at positions, movements by their length, counted sample by sample."""

from __future__ import annotations

import bisect
import math

from hil.service.in_service.figures import Histogram

PLACES = tuple(float(k) for k in range(0, 101, 5))
LENGTHS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Movements shorter than the first are not told from noise and from the resolution of a positioner [%]."""

LONGEST_STEP_S = 60.0
"""Time that one sample may stand for [s]: longer silences count as unknown."""


class Travel:
    """Counts of one valve. places_s : time by position [s]; lengths : movements by length; whole : travel [%]."""

    def __init__(self) -> None:
        self.places_s = [0.0] * (len(PLACES) - 1)
        self.lengths = [0.0] * (len(LENGTHS) - 1)
        self.observed_s = self.whole = 0.0
        self.reversals = 0
        self._last_s = math.nan
        self._way, self._far, self._turn = 0, math.nan, math.nan

    def add(self, time_s: float, position: float) -> None:
        """One good position [%] at a time [s]."""
        step = time_s - self._last_s
        self._last_s = time_s
        if 0.0 < step <= LONGEST_STEP_S:
            self.observed_s += step
            self.places_s[min(max(int(position // 5.0), 0), len(self.places_s) - 1)] += step
        self._move(position)

    def _move(self, position: float) -> None:
        if math.isnan(self._far):
            self._far = self._turn = position
        elif self._way * (position - self._far) >= 0.0 and self._way:
            self._far = position
        elif abs(position - self._far) >= LENGTHS[0]:
            if self._way:
                self._moved(abs(self._far - self._turn))
            self._turn, self._far, self._way = self._far, position, 1 if position > self._far else -1

    def _moved(self, length: float) -> None:
        """One movement has ended."""
        self.reversals += 1
        self.whole += length
        place = min(bisect.bisect_right(LENGTHS, length) - 1, len(self.lengths) - 1)
        self.lengths[max(place, 0)] += 1.0

    @property
    def histograms(self) -> tuple[Histogram, Histogram]:
        """Time at positions [s], and movements by length."""
        return Histogram(PLACES, tuple(self.places_s), "%"), Histogram(LENGTHS, tuple(self.lengths), "%")
