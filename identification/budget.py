"""The time that a fit or a trace may take: at its end it answers with the best that it has, and says what it did not
try.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from recordings import BadParameter, Progress

T = TypeVar("T")


class Budget:
    """Seconds of a fit or a trace, from here on. not_tried : what there was no time for, in the order of the method.

    seconds : at least one; inf: as long as it takes. Where the budget is in force, a descent that has begun ends with
    the step at hand, so the answer comes a few seconds later. clock : monotonic [s].
    """

    def __init__(self, seconds: float = float("inf"), clock: Callable[[], float] = time.monotonic) -> None:
        if not seconds >= 1.0:
            raise BadParameter("budget", seconds, "nothing can be fitted in that", "give at least 1 s")
        self.seconds, self._clock, self._began = seconds, clock, clock()
        self.not_tried = list[str]()

    @contextmanager
    def in_force(self) -> Iterator[None]:
        """Inside, every descent of the thread that entered asks this budget (`time_is_over`)."""
        token = _IN_FORCE.set(self)
        try:
            yield
        finally:
            _IN_FORCE.reset(token)

    @property
    def spent(self) -> float:
        """Seconds since the work began."""
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

    def within(
        self, items: Sequence[T], stage: str, progress: Progress, name: Callable[[T], str],
        so_far: Callable[[], str],
    ) -> Iterator[T]:  # fmt: skip
        """The items one by one, with progress, as long as there is time; the others are not tried. name : of one;
        so_far : what came out of those before, in words.
        """
        for done, item in enumerate(items):
            if self.allows(name(item)):
                progress(f"{stage}: {name(item)}{so_far()}", done, len(items))
                yield item
        progress(stage, len(items), len(items))


_IN_FORCE: ContextVar[Budget | None] = ContextVar("budget in force", default=None)


def time_is_over() -> bool:
    """Whether the budget in force is spent; never, where there is none."""
    budget = _IN_FORCE.get()
    return budget is not None and budget.over
