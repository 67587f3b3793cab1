"""A server and a recorder for synchronous programs: each runs in a thread of its own while a `with` block lasts.

>>> from hil import ActuatorPlant, ActuatorSetup, BackgroundServer, RegisterMap, ServerSettings, listen_address
>>> settings = ServerSettings([listen_address("tcp://127.0.0.1:0")], RegisterMap.load("damadics"))
>>> with BackgroundServer({1: ActuatorPlant(ActuatorSetup())}, settings) as served:
...     served.address.startswith("tcp://127.0.0.1:")
True
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Mapping
from contextlib import AsyncExitStack
from types import TracebackType
from typing import Self

from hil.plant.pace import LatenessReport
from hil.plant.plant import ServedPlant
from hil.recorder.files import RecorderSettings
from hil.recorder.recorder import Recorder, RecorderReport
from hil.running import LoopThread, Stop
from hil.server.server import Server, ServerSettings
from hil.source.source import Source


class BackgroundServer:
    """Serves plants while a `with` block lasts, like `Server` and with the same parameters.

    Entering raises BadInput when an address cannot be used or a map does not fit the plants. Leaving raises what
    stopped plant time meanwhile, unless the block itself failed.
    """

    def __init__(self, plants: Mapping[int, ServedPlant], settings: ServerSettings) -> None:
        self._server = Server(plants, settings)

    def __enter__(self) -> Self:
        self._thread = LoopThread.entered("bristle server", self._server.__aenter__())
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            failure = self._thread.run(self._left())
        finally:
            self._thread.close()
        if failure is not None and error is None:
            raise failure

    @property
    def address(self) -> str:
        """Where clients find the server: the first of `addresses`."""
        return self.addresses[0]

    @property
    def addresses(self) -> list[str]:
        """Where clients find the server, one per listener."""
        return self._server.addresses

    def reports(self) -> dict[int, LatenessReport | None]:
        """Lateness by unit id; None in lock-step."""
        return self._server.reports()

    async def _left(self) -> BaseException | None:
        """Stop the server; what stopped plant time before, if anything did."""
        failed = asyncio.ensure_future(self._server.failed())
        await asyncio.sleep(0)  # `failed` looks at plant time once
        await self._server.__aexit__(None, None, None)
        (end,) = await asyncio.gather(failed, return_exceptions=True)
        return None if isinstance(end, asyncio.CancelledError) else end


class BackgroundRecorder:
    """Records a source while a `with` block lasts, like `Recorder` and with the same parameters.

    Leaving the block closes the files. It then raises what ended the recording before its time, unless the block
    itself failed. What was recorded until then is kept.

    Parameters
    ----------
    source : Source
        What is recorded; the recorder opens and closes it.
    settings : RecorderSettings
        How and where. Raises BadInput when nothing can be written there.
    duration_s : float, optional
        Record no longer than this [s].
    """

    def __init__(self, source: Source, settings: RecorderSettings, duration_s: float | None = None) -> None:
        self._source, self._duration_s = source, duration_s
        self._recorder = Recorder(source, settings)
        self._ended = threading.Event()
        self._failure: BaseException | None = None

    def __enter__(self) -> Self:
        self._thread = LoopThread("bristle recorder")
        try:
            self._thread.run(self._source.__aenter__())
            self._stop = Stop(self._duration_s, heard=())
            self._task = self._thread.start(self._record())
        except BaseException:
            self._thread.close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            self._thread.run(self._left())
        finally:
            self._thread.close()
        if self._failure is not None and error is None:
            raise self._failure

    @property
    def report(self) -> RecorderReport:
        """What there is so far; complete, with the names of the files, once the recording has ended."""
        return self._recorder.report

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until the recording has ended: the source ended, the duration is over, or something failed.

        timeout_s : wait no longer than this [s]. Returns whether it has ended.
        """
        return self._ended.wait(timeout_s)

    async def _record(self) -> None:
        try:
            async with AsyncExitStack() as opened:
                opened.push_async_exit(self._source)
                with self._stop:
                    await self._recorder.run(self._stop.event)
        except Exception as failure:
            self._failure = failure
        finally:
            self._ended.set()

    async def _left(self) -> None:
        self._stop.event.set()
        await self._task
