"""The page as the service has it: a process of its own that asks over a pipe, so that nothing waits for it."""

from __future__ import annotations

import asyncio
import os
import sys
from asyncio.subprocess import PIPE, Process
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from hil.page.access import Access, PageSettings
from hil.page.exchange import LONGEST_LINE, WatchedPlant, answered
from hil.page.start import PageStart
from hil.service.supervision import SupervisedTask

ENDS_WITHIN_S = 3.0
"""How long the process may take to end by itself [s]."""


class PageEnded(RuntimeError):
    """The process of the page ended by itself."""


class Page:
    """The live page of a plant. The address is bound at once; somebody answers there while `run` runs.

    Parameters
    ----------
    settings : PageSettings
        Where, and for whom. Raises BadInput when that cannot be.
    watched : WatchedPlant
        What is shown.
    recordings : Path, optional
        Folder with recordings of the valves, for their history.
    """

    def __init__(self, settings: PageSettings, watched: WatchedPlant, recordings: Path | None = None) -> None:
        self._access: Access = settings.access()
        self._watched, self._recordings = watched, recordings
        self._listening = self._access.bound()
        self.url = self._access.url(self._listening.getsockname()[1])
        self.process: int | None = None
        """Number of the process that serves; None while there is none."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Give the address back."""
        self._listening.close()

    async def run(self) -> None:
        """Serve the page until this is cancelled. Raises PageEnded when its process ends before; run it again then."""
        process = await self._started()
        self.process = process.pid
        try:
            await self._answer(process)
            code = await process.wait()
            raise PageEnded(f"the process of the page ended with code {code}")
        finally:
            self.process = None
            await _ended(process)

    async def always(self) -> None:
        """Serve the page until this is cancelled, and begin anew whenever it ends before."""
        await SupervisedTask("page", self.run).run()

    async def _started(self) -> Process:
        listening = self._listening.fileno()
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "hil.page.process", stdin=PIPE, stdout=PIPE, limit=LONGEST_LINE,
            pass_fds=(listening,), env=_environment(), start_new_session=True,
        )  # fmt: skip
        assert process.stdin is not None
        process.stdin.write(PageStart.of(self._access, listening, self._recordings).line())
        return process

    async def _answer(self, process: Process) -> None:
        """Answer one question after the other, until there are no more."""
        assert process.stdin is not None
        assert process.stdout is not None
        with suppress(ConnectionError):
            while line := await process.stdout.readline():
                process.stdin.write(answered(line, self._watched))
                await process.stdin.drain()


def _environment() -> dict[str, str]:
    """The environment without what would change bokeh's server, such as who may connect to it."""
    return {name: value for name, value in os.environ.items() if not name.startswith("BOKEH_")}


async def _ended(process: Process) -> None:
    """End the process: it does so by itself when its pipe is closed."""
    if process.stdin is not None:
        process.stdin.close()
    if process.returncode is not None:
        return
    try:
        await asyncio.wait_for(process.wait(), ENDS_WITHIN_S)
    except TimeoutError:
        process.kill()
        await process.wait()
