"""What `bristle monitor` and `bristle replay` share: the detector from options, events to their place, the end."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

from bristle.cli.watching.live_page import announce
from detector import LEAST_STROKES, Watch, described, learn_recordings
from hil import (
    Monitor,
    MonitorEnd,
    MonitorEvent,
    MonitorSession,
    Page,
    PageSettings,
    PollingStopped,
    RecorderSettings,
    ShownMonitor,
    Source,
    Statistics,
    WatchStatus,
    load_state,
    monitor_session,
)  # fmt: skip
from recordings import BadInput, NegativeAnswer, read
from simulator import ValveModel


@dataclass(frozen=True)
class MonitorOptions:
    """The options of both commands. model : file; learn_s [s]; calibrate : recordings of a healthy valve; state : file
    to resume from and to save to; false_alarms : a month; events : file, None for stdout; page : where it is served,
    None for no page; address, rate_hz : of the source, for the page.
    """

    model: Path
    learn_s: float | None
    calibrate: Sequence[Path]
    state: Path | None
    false_alarms: float
    events: Path | None
    duration_s: float | None = None
    record: RecorderSettings | None = None
    own_clock: bool = False
    page: PageSettings | None = None
    address: str = ""
    rate_hz: float = 10.0


def watch(source: Source, options: MonitorOptions) -> None:
    """Watch a source, from the options to the exit code. Raises NegativeAnswer when an alarm was raised."""
    model = ValveModel.read(options.model)
    monitor = Monitor.with_model(
        source.signals, model, options.false_alarms, options.learn_s, own_clock=options.own_clock, on_learned=_learned
    )
    _resume(monitor, options, model)
    with _opened(options.events) as sink:
        session = MonitorSession(
            (sink,),
            options.duration_s,
            options.state,
            model.model_dump_json(),
            options.record,
            _show if sys.stderr.isatty() else None,
        )
        end = _run(source, monitor, session) if options.page is None else _shown(source, monitor, session, options)
    _finish(end, monitor)


def _run(source: Source, monitor: Monitor, session: MonitorSession) -> MonitorEnd:
    try:
        return asyncio.run(monitor_session(source, monitor, session))
    except PollingStopped as stopped:
        raise NegativeAnswer(str(stopped)) from stopped


def _shown(source: Source, monitor: Monitor, session: MonitorSession, options: MonitorOptions) -> MonitorEnd:
    """The same with a live page, which ends with it. Raises BadInput when the page cannot be served."""
    address, model = options.address.partition("?")[0], ValveModel.read(options.model)
    shown = ShownMonitor(address, address, options.rate_hz, monitor, model, lambda: source.statistics.missed)
    folder = None if options.record is None else options.record.to
    with Page(options.page or PageSettings(), shown, folder) as page:
        announce(page)
        told = replace(session, taken=shown.take)

        async def both() -> MonitorEnd:
            serving = asyncio.ensure_future(page.always())
            try:
                return await monitor_session(source, monitor, told)
            finally:
                serving.cancel()
                await asyncio.gather(serving, return_exceptions=True)

        try:
            return asyncio.run(both())
        except PollingStopped as stopped:
            raise NegativeAnswer(str(stopped)) from stopped


def _resume(monitor: Monitor, options: MonitorOptions, model: ValveModel) -> None:
    """What is known before the first sample: from recordings, or from an earlier session."""
    if options.calibrate:
        watch = learn_recordings([read(path) for path in options.calibrate], model, options.false_alarms)
        for name in monitor.resume(dict.fromkeys(monitor.valves, (watch, None))):
            _learned(name, watch)
    elif options.state is not None and options.state.exists() and options.learn_s is None:
        known = load_state(options.state, model.model_dump_json())
        for name in monitor.resume(known):
            print(f"{name}: resumed from {options.state}", file=sys.stderr)
            _learned(name, known[name][0])


class _opened:
    """A sink that writes lines to a file, or to stdout; every line is out at once."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._file: IO[str] = sys.stdout

    def __enter__(self) -> Callable[[MonitorEvent], None]:
        if self._path is not None:
            try:
                self._file = self._path.open("a", encoding="utf-8")
            except OSError as error:
                found = f"it cannot be written ({error.strerror})"
                raise BadInput(str(self._path), found, "give another --events") from None
        return self._write

    def __exit__(self, *_: Any) -> None:
        if self._file is not sys.stdout:
            with suppress(OSError):  # what could not be written was counted
                self._file.close()

    def _write(self, event: MonitorEvent) -> None:
        print(event.json_line(), file=self._file, flush=True)


def _learned(valve: str, watch: Watch) -> None:
    for line in described(watch).splitlines():
        print(f"{valve}: {line}", file=sys.stderr, flush=True)


def _show(status: tuple[WatchStatus, ...], statistics: Statistics, seconds: float) -> None:
    shown = "  ".join(_word(one) for one in status[:4]) + (f"  and {len(status) - 4} more" if len(status) > 4 else "")
    counts = {"deadlines missed": statistics.missed, "failures": statistics.failures.total()}
    troubles = "".join(f"  {n} {what}" for what, n in counts.items() if n)
    print(f"\r{seconds:6.0f} s  {shown}{troubles} \033[K", end="", file=sys.stderr, flush=True)


def _word(one: WatchStatus) -> str:
    if one.phase == "learning":
        if one.learned < 1.0:
            return f"{one.valve}: learning {100 * one.learned:.0f} %"
        return f"{one.valve}: learning, {_so_far(one)}"
    if one.phase == "alarm":
        return f"{one.valve}: ALARM {one.fault or 'unknown kind'}"
    return f"{one.valve}: watching, {100 * min(one.load, 9.99):.0f} % of the limit"


def _so_far(one: WatchStatus) -> str:
    return f"{one.strokes} of {LEAST_STROKES} reversals, {one.gathered_s:.0f} s"


def _finish(end: MonitorEnd, monitor: Monitor) -> None:
    """The last words, and the exit code as an exception."""
    if sys.stderr.isatty():
        print(file=sys.stderr)
    samples = sum(one.samples for one in monitor.status)
    learning = [f"{one.valve} ({_so_far(one)})" for one in monitor.status if one.phase == "learning"]
    if end.recorded is not None:
        for valve in end.recorded.valves:
            for path in valve.files:
                print(f"{valve.valve}: recorded to {path}", file=sys.stderr)
    for failure, n in end.failures.items():
        print(f"{n} x {failure}", file=sys.stderr)
    failed = f", {end.failures.total()} failures" if end.failures else ""
    print(f"{samples} samples in {end.seconds:.1f} s, {end.alarms} alarms{failed}", file=sys.stderr)
    if end.alarms:
        raise NegativeAnswer(f"{end.alarms} alarms were raised")
    if end.stopped_by is signal.SIGINT:
        raise KeyboardInterrupt
    if learning:
        raise NegativeAnswer(f"it ended while {', '.join(learning)} was still learning: nothing was judged")
