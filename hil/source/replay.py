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
from recordings import Recording, SignalSpec, read

MISSING = "missing in the recording"


class ReplaySource:
    """The samples of a recording, then the end: unlike a plant, a recording is over at some time.

    The time of a sample is the recording's own, and its wall-clock time follows from when the recording was made. A
    value that is NaN is bad. Events of the kinds that a source knows come between the samples.

    address : which recording, and how fast; valve : its name, else the plant's tag or the file's name. Raises BadInput
    when the file cannot be read.
    """

    def __init__(self, address: ReplayAddress, valve: str | None = None) -> None:
        recording = read(address.path)
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
        named = [(name, signal.unit, signal.values) for name, signal in recording.signals.items() if name != "time"]
        for k, moment in enumerate(recording.time.tolist()):
            readings = {name: _reading(float(values[k]), unit) for name, unit, values in named}
            yield Sample(moment, wall + moment, self.valve, readings)


def _events(recording: Recording, valve: str) -> Iterator[LinkEvent]:
    wall = _made(recording)
    for event in sorted(recording.events, key=lambda event: event.time):
        for kind in get_args(EventKind):
            if event.kind == kind:
                yield LinkEvent(event.time, wall + event.time, valve, kind, event.text)


def _made(recording: Recording) -> float:
    return (recording.created or datetime.fromtimestamp(0, UTC)).timestamp()


def _reading(value: float, unit: str) -> Reading:
    return Reading(value, unit, Quality.BAD, MISSING) if math.isnan(value) else Reading(value, unit)
