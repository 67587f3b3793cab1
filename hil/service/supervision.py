"""Tasks that are looked after: one that fails is reported and begun again, later each time, and harms no other."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

from hil.client.state import BackOff
from hil.service.status import TaskStatus

AGAIN = BackOff(0.5, 60.0)
"""Rest before a failed task is begun again; the cap bounds how long a cured trouble is noticed late."""

STEADY_S = 120.0
"""A task that ran for so long had recovered: its next failure is a first one."""

LOG = logging.getLogger("bristle.monitor")


class SupervisedTask:
    """Work that goes on until it returns or is cancelled; an exception begins it anew after a rest.

    name : for status and log; work : makes the coroutine, once for every beginning; dropped : how much it was too slow
    for, so far; again : the rests. `run` may be awaited in any event loop, and `status` read from any thread.
    """

    def __init__(
        self,
        name: str,
        work: Callable[[], Awaitable[object]],
        dropped: Callable[[], int] = lambda: 0,
        again: BackOff = AGAIN,
    ) -> None:
        self.name, self._work, self._dropped, self._again = name, work, dropped, again
        self.restarts, self.last_error = 0, ""
        self.running = self.ended = False

    @property
    def status(self) -> TaskStatus:
        """How it stands."""
        return TaskStatus(self.name, self.running, self.restarts, self.last_error, self._dropped())

    async def run(self) -> None:
        """Work, and begin anew after every failure, until the work returns."""
        loop, failures = asyncio.get_running_loop(), 0
        while True:
            began = loop.time()
            try:
                self.running = True
                await self._work()
                self.ended = True
                return
            except Exception as error:
                self.last_error = f"{type(error).__name__}: {error}"
            finally:
                self.running = False
            failures = 1 if loop.time() - began > STEADY_S else failures + 1
            rest = self._again.delay(failures)
            LOG.warning("task '%s' failed: %s; it begins anew in %.3g s", self.name, self.last_error, rest)
            self.restarts += 1
            await asyncio.sleep(rest)
