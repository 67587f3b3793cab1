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
    for, so far; again : the rests; steady_s : after so long it has recovered [s]. `run` may be awaited in any event
    loop, and `status` read from any thread. A trouble that lasts is logged when it begins and when it is over.
    """

    def __init__(
        self,
        name: str,
        work: Callable[[], Awaitable[object]],
        dropped: Callable[[], int] = lambda: 0,
        again: BackOff = AGAIN,
        steady_s: float = STEADY_S,
    ) -> None:
        self.name, self._work, self._dropped, self._again = name, work, dropped, again
        self.restarts, self.last_error, self._steady_s = 0, "", steady_s
        self._failures, self._logged = 0, ""
        self.running = self.ended = False

    @property
    def status(self) -> TaskStatus:
        """How it stands."""
        return TaskStatus(self.name, self.running, self.restarts, self.last_error, self._dropped())

    async def run(self) -> None:
        """Work, and begin anew after every failure, until the work returns."""
        loop = asyncio.get_running_loop()
        while True:
            recovered = loop.call_later(self._steady_s, self._recovered)
            try:
                self.running = True
                await self._work()
                self.ended = True
                return
            except Exception as error:
                self.last_error = f"{type(error).__name__}: {error}"
            finally:
                self.running = False
                recovered.cancel()
            self._failures += 1
            self.restarts += 1
            self._tell()
            await asyncio.sleep(self._again.delay(self._failures))

    def _tell(self) -> None:
        if self.last_error != self._logged:
            LOG.warning("task '%s' failed: %s; it is begun anew until it runs", self.name, self.last_error)
        self._logged = self.last_error

    def _recovered(self) -> None:
        if self._failures:
            LOG.warning("task '%s' runs again; it had failed %d times", self.name, self._failures)
        self._failures, self._logged = 0, ""
