"""What `bristle monitor` and `bristle replay` share: the detector from options, events to their place, the end."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from collections import deque
from collections.abc import Callable, Coroutine, Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np

from bristle.cli.console import writable
from bristle.cli.output.live import Latest, LiveLine
from bristle.cli.output.manner import answer, manner, note
from bristle.cli.watching.live_page import announce
from bristle.door.sources import read
from detector import Judgement, Watch, WatchCourse, WatchedValve, described, learn_recordings, watch_page
from hil import (
    LinkEvent,
    Monitor,
    MonitorEnd,
    MonitorEvent,
    MonitorSession,
    Page,
    PageSettings,
    PollingStopped,
    RecorderSettings,
    Sample,
    ShownMonitor,
    Source,
    Statistics,
    WatchStatus,
    load_state,
    monitor_session,
)  # fmt: skip
from recordings import BadInput, NegativeAnswer, may_pass, save_text
from simulator import ValveModel

MOST_KEPT = 10_000
"""The newest events that the object of ``--json`` holds."""


@dataclass(frozen=True)
class MonitorOptions:
    """The options of both commands. model : file; learn_s [s]; calibrate : recordings of a healthy valve; state : file
    to resume from and to save to; false_alarms : a month; events : file, None for stdout; page : where it is served,
    None for no page; address, rate_hz : of the source, for the page, and to start from the model alone; report : file
    to write at the end, None for none; recording : that is played back, whose rate counts then, empty for none.
    """

    model: Path
    learn_s: float | None
    calibrate: Sequence[str]
    state: Path | None
    false_alarms: float
    events: Path | None
    duration_s: float | None = None
    record: RecorderSettings | None = None
    own_clock: bool = False
    page: PageSettings | None = None
    address: str = ""
    rate_hz: float = 10.0
    report: Path | None = None
    recording: str = ""


def watch(source: Source, options: MonitorOptions) -> None:
    """Watch a source, from the options to the exit code. Raises NegativeAnswer when an alarm was raised."""
    writable(options.report)
    model = ValveModel.read(options.model)
    live, line = Latest(source), LiveLine()
    monitor = Monitor.with_model(
        source.signals,
        model,
        options.false_alarms,
        options.learn_s,
        own_clock=options.own_clock,
        on_learned=lambda valve, found: _learned(valve, found, line),
    )
    _resume(monitor, options, model)
    kept, courses, told = deque[MonitorEvent](maxlen=MOST_KEPT), _Courses(monitor), set[str]()

    def show(status: tuple[WatchStatus, ...], statistics: Statistics, seconds: float) -> None:
        for failure in [one for one in statistics.failures if one not in told]:
            line.say(f"{failure}; the watching goes on")
            told.add(failure)
        line.update(seconds, f"{_standing(status, statistics)}  {live.words()}")

    with _opened(options.events, mute=manner().json) as sink:
        sinks = (sink, kept.append)
        session = MonitorSession(
            sinks, options.duration_s, options.state, model.model_dump_json(), options.record, show, courses.take
        )
        if options.page is None:
            end = _ended(monitor_session(live, monitor, session))
        else:
            end = _shown(live, monitor, session, options, model)
    line.end()
    answer(_result(end, monitor, kept))
    if options.report is not None:
        save_text(options.report, courses.page())
    _finish(end, monitor)


def _ended(session: Coroutine[Any, Any, MonitorEnd]) -> MonitorEnd:
    try:
        return asyncio.run(session)
    except PollingStopped as stopped:
        raise NegativeAnswer(str(stopped)) from stopped


def _shown(
    source: Source, monitor: Monitor, session: MonitorSession, options: MonitorOptions, model: ValveModel
) -> MonitorEnd:
    """The same with a live page, which ends with it. Raises BadInput when the page cannot be served."""
    address = options.address.partition("?")[0]
    shown = ShownMonitor(address, address, options.rate_hz, monitor, model, lambda: source.statistics.missed)
    folder = None if options.record is None else options.record.to
    with Page(options.page or PageSettings(), shown, folder) as page:
        announce(page)

        def take(item: Sample | LinkEvent, event: MonitorEvent | None) -> None:
            shown.take(item, event)
            if session.taken is not None:
                session.taken(item, event)

        told = replace(session, taken=take)

        async def both() -> MonitorEnd:
            serving = asyncio.ensure_future(page.always())
            try:
                return await monitor_session(source, monitor, told)
            finally:
                serving.cancel()
                await asyncio.gather(serving, return_exceptions=True)

        return _ended(both())


def _resume(monitor: Monitor, options: MonitorOptions, model: ValveModel) -> None:
    """What is known before the first sample: from recordings, from an earlier session, or from the model alone."""
    if options.calibrate:
        watch = learn_recordings([read(path) for path in options.calibrate], model, options.false_alarms)
        for name in monitor.resume(dict.fromkeys(monitor.valves, (watch, None))):
            _learned(name, watch, LiveLine())
    elif options.state is not None and options.state.exists() and options.learn_s is None:
        known = load_state(options.state, model.model_dump_json())
        for name in monitor.resume(known):
            note(f"{name}: resumed from {options.state}")
            _learned(name, known[name][0], LiveLine())
    elif options.learn_s is None:
        played = options.recording
        dt_s = float(np.median(np.diff(read(played).time))) if played else 1.0 / options.rate_hz
        monitor.start(model, dt_s, options.false_alarms)
        for name, valve in monitor.valves.items():
            if valve.watch is not None:
                _learned(name, valve.watch, LiveLine())


class _Courses:
    """What was seen of every valve so far, for the report at the end."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self._courses = {name: WatchCourse() for name in monitor.valves}
        self._newest: dict[str, Judgement | None] = dict.fromkeys(monitor.valves)

    def take(self, item: Sample | LinkEvent, event: MonitorEvent | None) -> None:
        """An item of the source, after the monitor has taken it."""
        judgement = self._monitor.valves[item.valve].judgement
        if judgement is not None and judgement is not self._newest[item.valve]:
            self._courses[item.valve].add(judgement)
            self._newest[item.valve] = judgement

    def page(self) -> str:
        """The report."""
        watches = {name: valve.watch for name, valve in self._monitor.valves.items()}
        learned = {name: "" if one is None else one.evidence.promise.sentence for name, one in watches.items()}
        return watch_page([WatchedValve(name, learned[name], course) for name, course in self._courses.items()])


class _opened:
    """A sink that writes lines to a file, or to stdout; every line is out at once. mute : nothing goes to stdout."""

    def __init__(self, path: Path | None, mute: bool) -> None:
        self._path, self._mute = path, mute and path is None
        self._file: IO[str] | None = sys.stdout

    def __enter__(self) -> Callable[[MonitorEvent], None]:
        if self._path is not None:
            try:
                self._file = self._path.open("a", encoding="utf-8")
            except OSError as error:
                if not may_pass(error):
                    found = f"it cannot be written ({error.strerror})"
                    raise BadInput(str(self._path), found, "give another --events") from None
                self._file = None  # it is tried again with every event
        return self._write

    def __exit__(self, *_: Any) -> None:
        if self._file is not None and self._file is not sys.stdout:
            with suppress(OSError):  # what could not be written was counted
                self._file.close()

    def _write(self, event: MonitorEvent) -> None:
        if self._file is None and self._path is not None:
            self._file = self._path.open("a", encoding="utf-8")
        if not self._mute:
            print(event.json_line(), file=self._file, flush=True)


def _learned(valve: str, watch: Watch, line: LiveLine) -> None:
    for words in described(watch).splitlines():
        line.say(f"{valve}: {words}")


def _standing(status: tuple[WatchStatus, ...], statistics: Statistics) -> str:
    shown = "  ".join(_word(one) for one in status[:4]) + (f"  and {len(status) - 4} more" if len(status) > 4 else "")
    counts = {"deadlines missed": statistics.missed, "failures": statistics.failures.total()}
    return shown + "".join(f"  {n} {what}" for what, n in counts.items() if n)


def _word(one: WatchStatus) -> str:
    if one.phase == "learning":
        return f"{one.valve}: learning, {one.so_far}; {one.judged}"
    if one.phase == "alarm":
        return f"{one.valve}: ALARM {one.fault or 'unknown kind'}"
    return f"{one.valve}: watching, {100 * min(one.load, 9.99):.0f} % of the limit"


def _result(end: MonitorEnd, monitor: Monitor, kept: Iterable[MonitorEvent]) -> dict[str, Any]:
    """What came of it, as one object."""
    events = [json.loads(event.json_line()) for event in kept]
    return {
        "valves": [asdict(one) for one in monitor.status], "seconds": end.seconds, "alarms": end.alarms,
        "events": events, "failures": dict(end.failures),
        "recorded": [] if end.recorded is None else [path for one in end.recorded.valves for path in one.files],
    }  # fmt: skip


def _finish(end: MonitorEnd, monitor: Monitor) -> None:
    """The last words, and the exit code as an exception."""
    samples = sum(one.samples for one in monitor.status)
    learning = [one for one in monitor.status if one.phase == "learning"]
    if end.recorded is not None:
        for valve in end.recorded.valves:
            for path in valve.files:
                note(f"{valve.valve}: recorded to {path}")
    for failure, n in end.failures.items():
        note(f"{n} x {failure}")
    failed = f", {end.failures.total()} failures" if end.failures else ""
    note(f"{samples} samples in {end.seconds:.1f} s, {end.alarms} alarms{failed}")
    if end.alarms:
        raise NegativeAnswer(f"alarms raised: {end.alarms}")
    if end.unsaved is not None:
        raise end.unsaved
    if end.stopped_by is signal.SIGINT:
        raise KeyboardInterrupt
    for one in learning:
        note(f"{one.valve}: {one.judged}; {one.supported or 'nothing is gathered'}")
    if learning:
        names = ", ".join(f"{one.valve} ({one.so_far})" for one in learning)
        raise NegativeAnswer(f"it ended while {names} was still learning")
