"""A way for events to leave: a queue, a thread that may wait, and events that stay until they have gone."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

from hil.monitor.event import MonitorEvent
from hil.service.queue import BoundedQueue

WAITING = 2000
"""Events that may wait for a sink that is away."""

NAP_S = 0.1


class EventSink(Protocol):
    """Takes events away, one batch after the other. Called in a thread of its own.

    name : for the status of its task.
    """

    name: str

    def send(self, events: Sequence[MonitorEvent]) -> None:
        """Send them, in order. Raises whatever went wrong: all of them are sent again later."""

    def close(self) -> None:
        """Let go of what is open."""


class SinkTask:
    """Feeds a sink. Events that could not be sent are kept, in order, and tried again when the task begins anew."""

    def __init__(self, sink: EventSink) -> None:
        self.sink = sink
        self.queue: BoundedQueue[MonitorEvent] = BoundedQueue(WAITING)
        self._unsent: list[MonitorEvent] = []
        self._thread = ThreadPoolExecutor(1, sink.name)

    @property
    def waiting(self) -> int:
        """Events that have not gone."""
        return len(self._unsent) + len(self.queue)

    async def run(self) -> None:
        """Send until cancelled. Raises what the sink raises."""
        loop = asyncio.get_running_loop()
        while True:
            self._unsent = self._unsent or self.queue.take(100)
            if self._unsent:
                await loop.run_in_executor(self._thread, self.sink.send, tuple(self._unsent))
                self._unsent = []
            await asyncio.sleep(NAP_S)

    def close(self) -> None:
        """Close the sink; what still waits in it is not waited for."""
        self._thread.submit(self.sink.close)
        self._thread.shutdown(wait=False)
