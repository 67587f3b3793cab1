"""One run of the monitor as a program: a source is watched until it ends, its time is over, or a signal comes."""

from __future__ import annotations

import asyncio
import signal
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hil.monitor.event import MonitorEvent
from hil.monitor.monitor import Monitor
from hil.monitor.state import check_state, save_state
from hil.monitor.valve import WatchStatus
from hil.recorder.files import RecorderSettings
from hil.recorder.notes import Note, Notes
from hil.recorder.recorder import Recorder, RecorderReport
from hil.running import RepeatedTask, Stop, first_of, freeze_garbage, repeating
from hil.source.sample import LinkEvent, Sample
from hil.source.source import Source, SourceWrapper
from hil.source.statistics import Statistics
from recordings import BadInput

Sink = Callable[[MonitorEvent], None]
"""Where events go: a file, a terminal, and later a page."""

ShowWatching = Callable[[tuple[WatchStatus, ...], Statistics, float], None]
"""Shown, once a second, how the valves stand, what the source has done, and the seconds since the start."""

Taken = Callable[[Sample | LinkEvent, MonitorEvent | None], None]
"""Told every item of the source and the event that it made, if any: a page, for example. It must not wait."""

SHOW_EVERY_S = 1.0
SAVE_EVERY_S = 60.0
BREATHE_EVERY = 64
"""A recording is read without ever waiting; after so many samples signals get their turn."""


@dataclass(frozen=True)
class MonitorSession:
    """sinks : where events go; duration_s : stop after so long [s]; state, model_key : file for what is learned, and
    the model it belongs to; record : how the source is recorded meanwhile; show : see `ShowWatching`; taken :
    see `Taken`.
    """

    sinks: Sequence[Sink] = ()
    duration_s: float | None = None
    state: Path | None = None
    model_key: str = ""
    record: RecorderSettings | None = None
    show: ShowWatching | None = None
    taken: Taken | None = None


@dataclass(frozen=True)
class MonitorEnd:
    """How it ended. alarms : alarm events; stopped_by : the signal, None for the end of the source or of the time;
    recorded : what the recorder did, None without one; failures : how often an event could not be written, the state
    not be saved, or the recording not go on, by reason; unsaved : why the last state could not be saved, None if it is.
    """

    alarms: int
    seconds: float
    stopped_by: signal.Signals | None
    recorded: RecorderReport | None
    failures: Counter[str]
    unsaved: BadInput | None = None


class _Watched(SourceWrapper):
    """A source whose items pass the monitor first, and then go to whoever reads it: the recorder."""

    def __init__(self, source: Source, monitor: Monitor, sinks: Sequence[Sink], tell: Taken | None) -> None:
        super().__init__(source)
        self._monitor, self._sinks, self._tell = monitor, sinks, tell
        self._taken, self.notes = 0, Notes()
        self.failures = source.statistics.failures

    async def __anext__(self) -> Sample | LinkEvent:
        item = await anext(self._source)
        event = await self._monitor.take(item)
        if self._tell is not None:
            self._tell(item, event)
        if event is not None:
            if event.judged:
                self.notes.add(Note(item.time, item.valve, event.kind, event.text))
            for sink in self._sinks:
                try:
                    sink(event)
                except Exception as error:  # a full disk or a dead page must not end the watching
                    self.failures[f"an event could not be written ({error})"] += 1
        self._taken += 1
        if self._taken % BREATHE_EVERY == 0:
            await asyncio.sleep(0)
        return item

    async def run(self, stop: asyncio.Event) -> None:
        """Take everything, without a recorder, until `stop` is set or the source ends."""
        await first_of(stop.wait(), self._drain())

    async def _drain(self) -> None:
        async for _ in self:
            pass


async def monitor_session(source: Source, monitor: Monitor, session: MonitorSession) -> MonitorEnd:
    """Watch a source until it ends, the duration is over, or SIGINT or SIGTERM comes; what is learned is saved then.

    Raises BadInput as `Monitor.check`, `Monitor.take` and `Recorder.run` do, and PollingStopped as the source does.
    A state that cannot be saved, an event that cannot be written and a recording that cannot go on are counted.
    """
    monitor.check()
    if session.state is not None:
        check_state(session.state)
    watched = _Watched(source, monitor, session.sinks, session.taken)
    record = session.record
    recorder = None if record is None else Recorder(watched, replace(record, notes=watched.notes))
    failures = watched.failures
    freeze_garbage()
    try:
        with Stop(session.duration_s) as stop, repeating(failures, *_jobs(monitor, watched, session, stop)):
            async with watched:
                report = await (_recorded(recorder, watched, stop) if recorder else watched.run(stop.event))
    finally:  # what ended the watching, if anything did, is what is raised
        unsaved = _save(monitor, session, failures)
    return MonitorEnd(monitor.alarms, stop.seconds, stop.first_signal, report, failures, unsaved)


async def _recorded(recorder: Recorder, watched: _Watched, stop: Stop) -> RecorderReport:
    """Record what is watched; when the disk refuses, go on watching."""
    try:
        return await recorder.run(stop.event)
    except BadInput as problem:
        if recorder.refused is None:  # it is the source that cannot go on
            raise
        watched.failures[f"the recording ended ({problem})"] += 1
    await watched.run(stop.event)
    return recorder.report


def _jobs(monitor: Monitor, watched: _Watched, session: MonitorSession, stop: Stop) -> list[RepeatedTask]:
    def save() -> None:
        _save(monitor, session, watched.failures)

    jobs: list[RepeatedTask] = [(SAVE_EVERY_S, save)]
    show = session.show
    if show is not None:
        jobs.append((SHOW_EVERY_S, lambda: show(monitor.status, watched.statistics, stop.seconds)))
    return jobs


def _save(monitor: Monitor, session: MonitorSession, failures: Counter[str]) -> BadInput | None:
    """Save what is learned, if anything is. What the disk refuses is counted and returned: it is tried again."""
    if session.state is not None and any(valve.watch is not None for valve in monitor.valves.values()):
        try:
            save_state(session.state, list(monitor.valves.values()), session.model_key)
        except BadInput as problem:
            failures[f"the state could not be saved ({problem.found})"] += 1
            return problem
    return None
