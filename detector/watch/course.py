"""What a detector saw of a valve over time, kept small however long it lasts."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from detector.watch.judgement import Judgement
from recordings import Array

MOST_DRAWN = 4000
"""Points that are kept: when there are more, two and two become one."""

MOST_CHANGES = 500
"""Of the changes the newest are kept."""


class WatchCourse:
    """The judgements of a valve, one after the other. samples, used, alarms : how many there were, how many of them
    were judged, and how often an alarm began; changes : the newest that began, ended or renamed an alarm; last : the
    newest that was judged, None before the first.

    >>> WatchCourse().samples
    0
    """

    def __init__(self, most: int = MOST_DRAWN) -> None:
        self.samples = self.used = self.alarms = 0
        self.first_s = self.last_s = 0.0
        self.last: Judgement | None = None
        self._changes = deque[Judgement](maxlen=MOST_CHANGES)
        self._most, self._width, self._in_last = most, 1, 0
        self._points: list[tuple[float, float, bool]] = []

    @classmethod
    def of(cls, judgements: Iterable[Judgement]) -> WatchCourse:
        """The course of judgements that are all there."""
        made = cls()
        for one in judgements:
            made.add(one)
        return made

    def add(self, one: Judgement) -> None:
        """The next judgement."""
        if not self.samples:
            self.first_s = one.time_s
        self.samples += 1
        self.last_s = one.time_s
        self.alarms += one.began
        if one.changed:
            self._changes.append(one)
        if one.verdict.used:
            self.used, self.last = self.used + 1, one
        self._draw(one.time_s, one.load if one.verdict.used else 0.0, one.alarm)

    def _draw(self, time_s: float, load: float, alarm: bool) -> None:
        if self._in_last in (0, self._width):
            if len(self._points) >= self._most:
                self._halve()
            self._points.append((time_s, load, alarm))
            self._in_last = 1
        else:
            at, highest, any_alarm = self._points[-1]
            self._points[-1] = (at, max(highest, load), any_alarm or alarm)
            self._in_last += 1

    def _halve(self) -> None:
        pairs = zip(self._points[::2], self._points[1::2], strict=False)
        self._points = [(a[0], max(a[1], b[1]), a[2] or b[2]) for a, b in pairs]
        self._width *= 2

    @property
    def changes(self) -> tuple[Judgement, ...]:
        """The newest changes, in order."""
        return tuple(self._changes)

    @property
    def time_s(self) -> Array:
        """When each stretch that is drawn began [s]."""
        return np.array([at for at, _, _ in self._points], float)

    @property
    def load(self) -> Array:
        """The largest score of each stretch."""
        return np.array([load for _, load, _ in self._points], float)

    @property
    def alarm(self) -> NDArray[np.bool_]:
        """Whether there was an alarm in each stretch."""
        return np.array([alarm for _, _, alarm in self._points], bool)
