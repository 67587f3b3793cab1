"""The recorder: a source into crash-safe recordings.

Samples wait half a second, then go to the disk in one batch, in a thread of their own, so that a slow disk delays no
poll. A value that is not good is NaN in the file, which keeps its quality, and the source's event beside it says
why. Each value has its own time there, that of its reply. Notes of whoever watches become events, too.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, nullcontext, suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from hil.recorder.files import FileSeries, RecordedRow, RecorderSettings
from hil.recorder.notes import Note
from hil.running import first_of
from hil.source.sample import LinkEvent, Quality, Sample, elapsed
from hil.source.source import Source
from hil.source.statistics import Statistics
from recordings import BadInput, Event, NegativeAnswer

FIRST_SAMPLES = 20
"""Not one good value in so many: the map does not fit the device, and hours of missing values help nobody."""

_CODES = {quality: code for code, quality in enumerate(Quality)}

MOST_WAITING = 10_000
"""Samples that may wait in memory; then the source has to wait for the disk."""


@dataclass
class ValveReport:
    """What was recorded of one valve. bad : samples with a value that was not good; usable : samples with one that was;
    first, last : times [s].
    """

    valve: str
    files: tuple[Path, ...] = ()
    samples: int = 0
    bad: int = 0
    usable: int = 0
    first: float = 0.0
    last: float = 0.0

    @property
    def rate(self) -> float:
        """Samples per second that were achieved, outages included."""
        return (self.samples - 1) / (self.last - self.first) if self.last > self.first else 0.0


@dataclass(frozen=True)
class RecorderReport:
    """What a session came to."""

    valves: tuple[ValveReport, ...]
    statistics: Statistics

    @property
    def samples(self) -> int:
        """Samples recorded, over all valves."""
        return sum(valve.samples for valve in self.valves)


@dataclass
class _Lane:
    """One valve on its way to the disk."""

    names: Sequence[str]
    report: ValveReport
    series: FileSeries | None = None
    rows: list[RecordedRow] = field(default_factory=list)
    events: list[LinkEvent | Note] = field(default_factory=list)

    def take(self, sample: Sample, origin: float) -> None:
        moment, report = elapsed(sample.time, origin), self.report
        readings = [sample.readings[name] for name in self.names]
        codes = [_CODES[reading.quality] for reading in readings]
        times = [elapsed(reading.time, origin) for reading in readings]
        self.rows.append((moment, *[reading.usable for reading in readings], *codes, *times))
        report.bad += not sample.good
        report.usable += any(reading.good for reading in sample.readings.values())
        report.first = report.first if report.samples else moment
        report.last, report.samples = moment, report.samples + 1

    def batch(self, origin: float) -> tuple[list[RecordedRow], list[Event]]:
        rows, events, self.rows, self.events = self.rows, self.events, [], []
        return rows, [Event(event.time - origin, event.kind, event.text) for event in events]


class Recorder:
    """Records a source until it ends or is told to stop.

    The clock of the recordings is monotonic and begins with the first sample of the session; `created` is the
    wall-clock time of that moment, in every file. An event before it has a negative time.

    source : entered already; settings : see `RecorderSettings`; disk : one thread that several recorders share, else
    each has its own. Raises BadInput when nothing can be written there. `refused` is what the disk has refused, None as
    long as it takes everything.
    """

    def __init__(self, source: Source, settings: RecorderSettings, disk: ThreadPoolExecutor | None = None) -> None:
        settings.check(list(source.signals))
        self.refused: BadInput | None = None
        self._source, self._settings = source, settings
        self._lanes = {
            valve: _Lane([spec.name for spec in specs if spec.role != "time"], ValveReport(valve))
            for valve, specs in source.signals.items()
        }
        self._origin: float | None = None
        self._n_waiting = 0
        self._shared = disk is not None
        # One thread: batches stay in order, and HDF5 likes no second one.
        self._disk = disk or ThreadPoolExecutor(1, "disk")
        self._turn = asyncio.Lock()

    @property
    def report(self) -> RecorderReport:
        """What there is so far."""
        return RecorderReport(tuple(lane.report for lane in self._lanes.values()), self._source.statistics)

    async def run(self, stop: asyncio.Event) -> RecorderReport:
        """Record until `stop` is set or the source ends.

        Raises what the source raises, BadInput when the disk refuses, and NegativeAnswer when none of a valve's first
        values is good; what was recorded until then is kept.
        """
        failed = False
        try:  # with the turn held, a batch on its way to the disk gets there, and says so if it does not
            await first_of(self._collect(), self._write_again_and_again(), stop.wait(), held=self._turn)
        except Exception:
            failed = True
            raise
        finally:
            with suppress(BadInput) if failed else nullcontext():  # the first failure is the one to show
                await self._finish()
        return self.report

    async def _collect(self) -> None:
        async for item in self._source:
            lane = self._lanes[item.valve]
            if isinstance(item, LinkEvent):
                lane.events.append(item)
                self._tell(item)
                continue
            origin = self._begin(item) if self._origin is None else self._origin
            lane.take(item, origin)
            if self._settings.refuse_unusable:
                _check_first(lane.report, item)
            self._n_waiting += 1
            if self._n_waiting >= MOST_WAITING:
                await self._write()

    def _tell(self, event: LinkEvent) -> None:
        if self._settings.tell:
            try:
                self._settings.tell(event)
            except Exception as error:  # whoever is told must not end the recording
                self._source.statistics.failures[f"an event could not be told ({error})"] += 1

    def _acknowledge(self, path: Path, n_samples: int) -> None:
        try:
            if self._settings.acknowledge:
                self._settings.acknowledge(path, n_samples)
        except OSError as error:
            self._source.statistics.failures[f"a batch could not be acknowledged ({error})"] += 1

    def _begin(self, first: Sample) -> float:
        self._origin, created = first.time, datetime.fromtimestamp(first.wall, UTC)
        for valve, lane in self._lanes.items():
            settings = replace(self._settings, acknowledge=self._acknowledge)
            lane.series = FileSeries(valve, self._source.signals[valve], created, settings)
        return self._origin

    def _take_notes(self) -> None:
        for note in self._settings.notes.take() if self._settings.notes else ():
            self._lanes[note.valve].events.append(note)

    async def _write_again_and_again(self) -> None:
        while True:
            await asyncio.sleep(self._settings.batch_s)
            await self._write()

    async def _write(self) -> None:
        """Everything that waits, onto the disk."""
        async with self._turn:
            if self._origin is None:
                return  # nothing but events so far
            self._take_notes()
            lanes = [lane for lane in self._lanes.values() if lane.rows or lane.events]
            batches = [(lane.series, *lane.batch(self._origin)) for lane in lanes]
            self._n_waiting = 0
            try:
                await asyncio.get_running_loop().run_in_executor(self._disk, _write_batches, batches)
            except BadInput as problem:
                self.refused = problem
                raise

    async def _finish(self) -> None:
        """Write what still waits, and close the files even if that fails."""
        try:
            await self._write()
        finally:
            try:
                await asyncio.get_running_loop().run_in_executor(self._disk, self._close)
            except BadInput as problem:
                self.refused = self.refused or problem
                raise
            finally:
                if not self._shared:
                    self._disk.shutdown()

    def _close(self) -> None:
        with ExitStack() as stack:  # closes every file, and then raises what went wrong
            for lane in self._lanes.values():
                if lane.series is not None:
                    lane.report.files = tuple(lane.series.files)
                    lane.report.samples -= lane.series.n_unrecorded
                    stack.callback(lane.series.close)


def _check_first(report: ValveReport, sample: Sample) -> None:
    if report.samples == FIRST_SAMPLES and not report.usable:
        why = next((reading.reason for reading in sample.readings.values() if reading.reason), "no reason known")
        found = f"not one good value in the first {FIRST_SAMPLES} samples ({why})"
        raise NegativeAnswer(f"{report.valve}: {found}; check the map and the device id")


def _write_batches(batches: Sequence[tuple[FileSeries | None, list[RecordedRow], list[Event]]]) -> None:
    for series, rows, events in batches:
        if series is not None:
            series.write(rows, events)
