"""One run of the recorder as a program: signals and a deadline stop it, and somebody watches its numbers."""

from __future__ import annotations

import asyncio
import gc
import signal
from collections.abc import Callable
from dataclasses import dataclass

from hil.recorder.files import RecorderSettings
from hil.recorder.recorder import Recorder, RecorderReport
from hil.source.source import Source

Show = Callable[[RecorderReport, float], None]
"""Shown the report so far and the seconds since the start, once a second."""

SHOW_EVERY_S = 1.0


def leave_to_itself() -> None:
    """Tell the garbage collector to look no more at what is loaded now.

    Otherwise it goes through all modules again and again, for 60 ms and more at a time, while polls are due.
    """
    gc.collect()
    gc.freeze()


@dataclass(frozen=True)
class SessionEnd:
    """How a session ended. interrupted : by SIGINT, as opposed to its deadline, SIGTERM or the end of the source."""

    report: RecorderReport
    seconds: float
    interrupted: bool


async def record_session(
    source: Source, settings: RecorderSettings, duration_s: float | None = None, show: Show | None = None
) -> SessionEnd:
    """Record a source until the duration is over, SIGINT or SIGTERM comes, or the source ends.

    Raises as `Recorder.run` does; the files are closed then, and what was recorded is in them.
    """
    loop, stop, seen = asyncio.get_running_loop(), asyncio.Event(), list[int]()

    def on_signal(number: int) -> None:
        seen.append(number)
        stop.set()

    recorder = Recorder(source, settings)
    leave_to_itself()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, on_signal, number)
    begun = loop.time()
    timer = None if duration_s is None else loop.call_later(duration_s, stop.set)
    shower = asyncio.ensure_future(_show_again_and_again(recorder, show, begun)) if show else None
    try:
        async with source:
            report = await recorder.run(stop)
    finally:
        for handle in (timer, shower):
            if handle is not None:
                handle.cancel()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
    return SessionEnd(report, loop.time() - begun, signal.SIGINT in seen)


async def _show_again_and_again(recorder: Recorder, show: Show, begun: float) -> None:
    loop = asyncio.get_running_loop()
    while True:
        await asyncio.sleep(SHOW_EVERY_S)
        show(recorder.report, loop.time() - begun)
