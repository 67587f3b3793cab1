"""From the task that polls to whoever iterates: nothing is dropped, and a slow reader slows the polling down."""

from __future__ import annotations

import asyncio
from collections import deque

from hil.source.sample import LinkEvent, Sample

BACKLOG = 4096
"""Items that may wait for the reader: 40 s at 100 Hz, longer than a disk is ever busy."""


class Channel:
    """A queue of samples and events with an end. backlog : items after which `room` waits."""

    def __init__(self, backlog: int = BACKLOG) -> None:
        self._items: deque[Sample | LinkEvent] = deque()
        self._backlog = backlog
        self._reader: asyncio.Future[None] | None = None
        self._writer: asyncio.Future[None] | None = None
        self._end: BaseException | None = None

    def put(self, item: Sample | LinkEvent) -> None:
        """Add an item, at once."""
        self._items.append(item)
        _wake(self._reader)

    def finish(self, reason: BaseException) -> None:
        """Raise `reason` for the reader once it has taken all that is there; only the first call counts."""
        self._end = self._end or reason
        _wake(self._reader)

    async def room(self) -> None:
        """Wait until the reader has caught up."""
        while len(self._items) >= self._backlog:
            self._writer = asyncio.get_running_loop().create_future()
            await self._writer

    async def get(self) -> Sample | LinkEvent:
        """The next item."""
        while not self._items:
            if self._end is not None:
                raise self._end
            self._reader = asyncio.get_running_loop().create_future()
            await self._reader
        if len(self._items) == self._backlog // 2:
            _wake(self._writer)
        return self._items.popleft()


def _wake(sleeper: asyncio.Future[None] | None) -> None:
    if sleeper is not None and not sleeper.done():
        sleeper.set_result(None)
