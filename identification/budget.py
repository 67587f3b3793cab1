"""The time that a trace may take: at its end it answers with the best that it has, and says what it did not try."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from recordings import BadParameter, Progress

T = TypeVar("T")


class Budget:
    """Seconds of a trace, from here on. not_tried : what there was no time for, in the order of the method.

    seconds : at least one; inf: as long as it takes. A fit that has begun is ended, so the answer comes a few seconds
    later. clock : monotonic [s].
    """

    def __init__(self, seconds: float = float("inf"), clock: Callable[[], float] = time.monotonic) -> None:
        if not seconds >= 1.0:
            raise BadParameter("budget", seconds, "no trace fits into that", "give at least 1 s")
        self.seconds, self._clock, self._began = seconds, clock, clock()
        self.not_tried = list[str]()

    @property
    def spent(self) -> float:
        """Seconds since the trace began."""
        return self._clock() - self._began

    @property
    def over(self) -> bool:
        """Whether no further work is to begin."""
        return self.spent >= self.seconds

    def allows(self, what: str) -> bool:
        """Whether there is time for some work; where not, it is not tried."""
        if self.over:
            self.not_tried.append(what)
        return not self.over

    def within(self, items: Sequence[T], stage: str, progress: Progress, name: Callable[[T], str]) -> Iterator[T]:
        """The items one by one, with progress, as long as there is time; the others are not tried. name : of one."""
        for done, item in enumerate(items):
            if self.allows(name(item)):
                progress(f"{stage}: {name(item)}", done, len(items))
                yield item
        progress(stage, len(items), len(items))

    def told(self, progress: Progress) -> Progress:
        """Progress that says how much time is left."""
        if self.seconds == float("inf"):
            return progress
        return lambda stage, done, total: progress(
            f"{max(self.seconds - self.spent, 0.0):.0f} s left, {stage}", done, total
        )
