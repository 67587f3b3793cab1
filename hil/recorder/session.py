"""One run of the recorder as a program: signals and a deadline stop it, and somebody watches its numbers."""

from __future__ import annotations

import signal
from collections.abc import Callable
from dataclasses import dataclass

from hil.recorder.files import RecorderSettings
from hil.recorder.recorder import Recorder, RecorderReport
from hil.running import Stop, freeze_garbage, repeating
from hil.source.source import Source

ShowRecording = Callable[[RecorderReport, float], None]
"""Shown the report so far and the seconds since the start, once a second."""

SHOW_EVERY_S = 1.0


@dataclass(frozen=True)
class RecorderEnd:
    """How a session ended. interrupted : by SIGINT, as opposed to its deadline, SIGTERM or the end of the source."""

    report: RecorderReport
    seconds: float
    interrupted: bool


async def record_session(
    source: Source, settings: RecorderSettings, duration_s: float | None = None, show: ShowRecording | None = None
) -> RecorderEnd:
    """Record a source until the duration is over, SIGINT or SIGTERM comes, or the source ends.

    Raises as `Recorder.run` does; the files are closed then, and what was recorded is in them.
    """
    recorder = Recorder(source, settings)
    freeze_garbage()
    with Stop(duration_s) as stop:
        shown = [(SHOW_EVERY_S, lambda: show(recorder.report, stop.seconds))] if show else []
        with repeating(source.statistics.failures, *shown):
            async with source:
                report = await recorder.run(stop.event)
    return RecorderEnd(report, stop.seconds, signal.SIGINT in stop.signals)
