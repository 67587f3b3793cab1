"""A recording played back: the same samples and events as from a live link, as fast as possible or paced."""

from __future__ import annotations

import asyncio
import heapq
import math
from collections.abc import AsyncGenerator, Iterator, Mapping
from datetime import UTC, datetime
from types import TracebackType
from typing import Self, get_args

from hil.source.address import ReplayAddress
from hil.source.sample import EventKind, LinkEvent, Quality, Reading, Sample
from hil.source.statistics import Statistics
from recordings import NOT_KNOWN, QUALITIES, Recording, SignalSpec, read

MISSING = "missing in the recording"


class ReplaySource:
    """The samples of a recording, then the end: unlike a plant, a recording is over at some time.

    The time of a sample is the recording's own, and its wall-clock time follows from when the recording was made. A
    value that is NaN is bad. Events of the kinds that a source knows come between the samples.

    address : which recording, and how fast; valve : its name, else the plant's tag or the file's name. Raises BadInput
    when the file cannot be read or computed with.
    """

    def __init__(self, address: ReplayAddress, valve: str | None = None) -> None:
        recording = read(address.path)
        recording.check()
        self.valve = valve or recording.plant.tag or address.path.stem
        self.signals: Mapping[str, tuple[SignalSpec, ...]] = {self.valve: recording.header.signals}
        self.statistics = Statistics()
        self.address = address
        self._recording = recording
        self._items = self._played()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await self._items.aclose()

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Sample | LinkEvent:
        return await anext(self._items)

    async def _played(self) -> AsyncGenerator[Sample | LinkEvent, None]:
        loop = asyncio.get_running_loop()
        started, first, pace = loop.time(), float(self._recording.time[0]), self.address.pace
        tracks: list[Iterator[Sample | LinkEvent]] = [_events(self._recording, self.valve), self._samples()]
        for item in heapq.merge(*tracks, key=lambda item: item.time):
            if pace is not None:
                late = loop.time() - started - (item.time - first) / pace
                await asyncio.sleep(-late)
            if isinstance(item, Sample):
                self.statistics.samples += 1
            yield item

    def _samples(self) -> Iterator[Sample]:
        recording, wall = self._recording, _made(self._recording)
        tracks = [_Track(recording, name) for name in recording if name != "time"]
        for k, moment in enumerate(recording.time.tolist()):
            readings = {track.name: track.reading(k, moment) for track in tracks}
            yield Sample(moment, wall + moment, self.valve, readings)


def _events(recording: Recording, valve: str) -> Iterator[LinkEvent]:
    wall = _made(recording)
    for event in sorted(recording.events, key=lambda event: event.time):
        for kind in get_args(EventKind):
            if event.kind == kind:
                yield LinkEvent(event.time, wall + event.time, valve, kind, event.text)


def _made(recording: Recording) -> float:
    return (recording.created or datetime.fromtimestamp(0, UTC)).timestamp()


class _Track:
    """One signal of a recording, with the quality and the reply times of its values where they were kept."""

    def __init__(self, recording: Recording, name: str) -> None:
        self.name, self._signal = name, recording[name]
        self._quality, self._times = recording.quality.get(name), recording.reply_times.get(name)

    def reading(self, k: int, moment: float) -> Reading:
        """The reading of sample k, which has the time `moment` [s]."""
        value, unit = float(self._signal.values[k]), self._signal.unit
        time = moment if self._times is None else float(self._times[k])
        if not math.isnan(value):
            return Reading(value, unit, time=time)
        code = 0 if self._quality is None else int(self._quality[k])
        if code in (0, NOT_KNOWN):
            return Reading(value, unit, Quality.NOT_VALID, MISSING, time)
        return Reading(value, unit, list(Quality)[code], f"it was {QUALITIES[code]} when it was recorded", time)
