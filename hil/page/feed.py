"""What the process of the page knows of the plant: the last answer, and the samples of valves that are looked at."""

from __future__ import annotations

import asyncio
import math
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from io import RawIOBase

from hil.page.exchange import COLUMNS, PageAnswer, RecentColumns, asked, understood
from hil.service.status import PlantStatus, ValveStatus

ASK_EVERY_S, UNSEEN_S = 0.25, 0.75
"""How often the monitor is asked while somebody looks, and while nobody does [s]."""
KEPT_S, KEPT_POINTS = 600.0, 6000
"""How much of a valve is kept for who opens its page next [s], and at most how many samples."""

USUAL_S = 1.5
"""With a question unanswered for so long the monitor is silent; a valve without a value for that long, and three times
as long as is usual [s]."""

KNOWN = 10
"""Samples from which on the usual time between two of them is known."""


@dataclass(frozen=True)
class Silence:
    """That data stopped. seconds : since the last; words : what is silent."""

    seconds: float
    words: str


class Feed:
    """The plant as it was last told. answers, questions : the pipes from the monitor and to it, unbuffered."""

    def __init__(self, answers: asyncio.StreamReader, questions: RawIOBase) -> None:
        self._answers, self._questions = answers, questions
        self.status: PlantStatus | None = None
        self._told_s = time.monotonic()
        self._asked_s: float | None = None  # when, if there is no answer yet
        self._looked_at: Counter[str] = Counter()
        self._samples: dict[str, FeedSamples] = {}
        self._first: dict[str, tuple[float, int]] = {}
        self._open, self._opened = 0, asyncio.Event()

    async def run(self) -> None:
        """Ask again and again, until the monitor has gone."""
        began = time.monotonic()
        while await self.ask():
            rest = max(0.02, (ASK_EVERY_S if self._open else UNSEEN_S) - (time.monotonic() - began))
            self._opened.clear()
            with suppress(TimeoutError):  # whoever comes does not wait until it is time to ask
                await asyncio.wait_for(self._opened.wait(), rest)
            began = time.monotonic()

    async def ask(self) -> bool:
        """Ask once; returns whether the monitor is still there."""
        self._asked_s = time.monotonic()
        self._questions.write(asked({tag: self.samples(tag).newest_s for tag in +self._looked_at}))  # a small one
        line = await self._answers.readline()
        if line:
            self._take(understood(line))
            self._asked_s = None
        return bool(line)

    def valve(self, tag: str) -> ValveStatus | None:
        """How a valve stands; None when there is no such tag."""
        valves = self.status.valves if self.status else ()
        return next((one for one in valves if one.tag == tag), None)

    def samples(self, tag: str) -> FeedSamples:
        """The newest samples of a valve, for as long as somebody looks at it."""
        return self._samples.setdefault(tag, FeedSamples())

    def open(self) -> None:
        """Somebody opened a page."""
        self._open += 1
        self._opened.set()

    def close(self) -> None:
        """Somebody closed one."""
        self._open -= 1

    def look(self, tag: str) -> None:
        """Somebody opened the page of a valve."""
        self._looked_at[tag] += 1

    def look_away(self, tag: str) -> None:
        """Somebody closed it; what was kept is forgotten with the last one."""
        self._looked_at[tag] -= 1
        if self._looked_at[tag] <= 0:
            del self._looked_at[tag]
            self._samples.pop(tag, None)

    @property
    def silence(self) -> Silence | None:
        """Whether the monitor itself has stopped to answer. One that was not asked has not."""
        now = time.monotonic()
        silent = self._asked_s is not None and now - self._asked_s > USUAL_S
        return Silence(now - self._told_s, "the monitor does not answer") if silent else None

    def silence_of(self, valve: ValveStatus) -> Silence | None:
        """Whether the data of a valve have stopped. A source that is polled seldom is given its time."""
        link = valve.link
        age = link.age_s + (time.monotonic() - self._told_s)
        if not link.connected:
            return Silence(age, "the link is down")
        if "position" not in valve.latest or age > max(USUAL_S, 3.0 * self._usual_s(valve)):
            return Silence(age, "no good value comes")
        return None

    def _usual_s(self, valve: ValveStatus) -> float:
        """Mean time between samples since the link came up [s]; infinite where that is not known yet."""
        since, samples = self._first[valve.tag]
        gained = valve.link.samples - samples
        return (time.monotonic() - since) / gained if gained >= KNOWN else math.inf

    def _take(self, answer: PageAnswer) -> None:
        self.status, self._told_s = answer.status, time.monotonic()
        for valve in answer.status.valves:
            if not valve.link.connected or valve.tag not in self._first:
                self._first[valve.tag] = (self._told_s, valve.link.samples)
        for tag, recent in answer.recent.items():
            if self._looked_at[tag]:
                self.samples(tag).add(recent)


class FeedSamples:
    """The newest samples of a valve, column by column; a column that is not read is None."""

    def __init__(self) -> None:
        self.columns: dict[str, list[float] | None] = {name: [] for name in COLUMNS}
        self.added = 0

    def __len__(self) -> int:
        return len(self.times)

    @property
    def times(self) -> list[float]:
        """When each was taken [POSIX s]."""
        return self.columns["time_s"] or []

    @property
    def newest_s(self) -> float:
        """When the newest was taken [POSIX s]; 0 before there is one."""
        return self.times[-1] if self.times else 0.0

    def add(self, new: RecentColumns) -> None:
        """Append, and forget what is too old or too much."""
        if not len(new):
            return
        for name in COLUMNS:
            column, more = self.columns[name], getattr(new, name)
            self.columns[name] = None if more is None else [*(column or ()), *more]
        self.added += len(new)
        times, horizon = self.times, new.time_s[-1] - KEPT_S
        drop = max(len(times) - KEPT_POINTS, next((i for i, t in enumerate(times) if t >= horizon), 0))
        if drop > 0:
            self.columns = {name: None if c is None else c[drop:] for name, c in self.columns.items()}
