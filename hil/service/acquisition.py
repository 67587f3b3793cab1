"""Acquisition: one source read for as long as it lasts, what is known of the way to each valve, and items passed on.

It runs in a thread with an event loop of its own and never waits for anybody: what follows takes items from bounded
queues. Only a recording is played back no faster than the queues are emptied.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Mapping, Sequence

from hil.service.plan import SourcePlan
from hil.service.queue import BoundedQueue
from hil.service.status import LinkStatus
from hil.source.sample import LinkEvent, Quality, Sample
from hil.source.source import Source

ItemQueue = BoundedQueue[Sample | LinkEvent]

REMEMBERED, SPOKEN_S = 20, 60.0
"""Troubles of the link that are remembered, and for how long they are spoken of [s]."""

_NOT_FRESH = (Quality.LINK, Quality.STALE)
"""Of these values the device has said nothing; of the other ones, nothing that is usable."""

_Reasons = tuple[tuple[str, str], ...]

ROOM_S = 0.005
STALE_S, STALE_PERIODS = 2.0, 3.0
"""A position is stale after so many seconds, or so many periods where these are longer."""


class ValveLink:
    """What is known of the way to one valve. Written by the acquisition, read by everybody.

    queues : where items go; rate_hz : of the source.
    """

    def __init__(self, tag: str, source: str, rate_hz: float, queues: Sequence[ItemQueue]) -> None:
        self.tag, self.source, self.queues = tag, source, tuple(queues)
        self.stale_s = max(STALE_S, STALE_PERIODS / rate_hz)
        self.connected, self.down = False, ""
        self.samples = self.reconnects = 0
        self.newest: Sample | None = None
        self._good_at, self._was_down = -math.inf, False
        self._all_good_at, self._each_good_at = -math.inf, dict[str, float]()
        self._troubles: deque[tuple[float, str]] = deque(maxlen=REMEMBERED)

    def take(self, item: Sample | LinkEvent, now: float) -> None:
        """One item of the source, at a monotonic time [s]: noted, and passed on."""
        if isinstance(item, Sample):
            self.samples += 1
            self.connected = True
            self.newest = item
            if item.good:
                self._all_good_at = now
            else:
                self._each_good_at |= {name: now for name, reading in item.readings.items() if reading.good}
            position = item.readings.get("position")
            if position is not None and position.good:
                self._good_at = now
        else:
            self._event(item, now)
        for queue in self.queues:
            queue.put(item)

    def lost(self) -> int:
        """Items that queues have dropped."""
        return sum(queue.dropped for queue in self.queues)

    def age_s(self, now: float) -> float:
        """Time since the last good position [s]; infinite before the first."""
        return now - self._good_at

    def unusable(self, now: float) -> tuple[_Reasons, _Reasons]:
        """Signals without a good value for `stale_s`, with the reason: those of which the device said nothing usable,
        and those of which nothing fresh came. One bad value between good ones is none of them.
        """
        newest = self.newest
        if newest is None or newest.good or now - self._all_good_at <= self.stale_s:
            return (), ()
        lacking = {
            name: reading
            for name, reading in newest.readings.items()
            if not reading.good and now - self._each_good_at.get(name, -math.inf) > self.stale_s
        }
        reasons = {name: f"{reading.quality}: {reading.reason}" for name, reading in lacking.items()}
        unread = tuple(one for one in reasons.items() if lacking[one[0]].quality in _NOT_FRESH)
        return tuple(one for one in reasons.items() if one not in unread), unread

    def status(self, now: float, late: int) -> LinkStatus:
        """As others see it. late : deadlines missed on the source."""
        age, lost = self.age_s(now), self.lost()
        words = "connected" if self.connected else f"not connected: {self.down or 'no answer yet'}"
        if math.isfinite(age):
            words += f"; last good position {age:.1f} s ago"
        troubles = [text for at, text in tuple(self._troubles) if now - at <= SPOKEN_S]
        if troubles:
            words += f"; in the last minute {len(troubles)} trouble(s), the last: {troubles[-1]}"
        if lost or late:
            words += f"; {lost} samples dropped, {late} deadlines missed"
        return LinkStatus(self.source, self.connected, age, self.samples, lost, late, self.reconnects, words)

    def _event(self, event: LinkEvent, now: float) -> None:
        if event.kind == "link_up":
            self.reconnects += self._was_down
            self.connected, self.down = True, ""
        elif event.kind == "link_down":
            self.connected, self.down, self._was_down = False, event.text, True
        if event.kind != "link_up":
            self._troubles.append((now, f"{event.kind}: {event.text}"))


class Acquisition:
    """Reads one source, again from the beginning of a new one when it failed. links : by the tag of the valve."""

    def __init__(self, plan: SourcePlan, links: Mapping[str, ValveLink]) -> None:
        self.plan, self._links = plan, links
        self._source: Source | None = None
        self._missed = self._polls = 0

    @property
    def missed(self) -> int:
        """Deadlines missed since the service started."""
        return self._missed + (self._source.statistics.missed if self._source else 0)

    @property
    def polls(self) -> int:
        """Rounds begun since the service started."""
        return self._polls + (self._source.statistics.polls if self._source else 0)

    async def run(self) -> None:
        """Read until the source ends. Raises what the source raises."""
        loop = asyncio.get_running_loop()
        source = self._source = self.plan.open()
        try:
            async with source:
                async for item in source:
                    link = self._links[item.valve]
                    while self.plan.ends and any(queue.full for queue in link.queues):
                        await asyncio.sleep(ROOM_S)
                    link.take(item, loop.time())
        except Exception as error:
            self._ended(f"{type(error).__name__}: {error}")
            raise
        else:
            self._ended("the recording has ended")
        finally:
            self._missed, self._polls, self._source = self.missed, self.polls, None

    def _ended(self, reason: str) -> None:
        for link in self._links.values():
            link.connected, link.down = False, reason
