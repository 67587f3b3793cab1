"""Fetching every sample that a device keeps in its ring, over a link far too slow to ask for each of them in time."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, cast

from hil.modbus.messages import Request
from hil.registers.point import READ_FUNCTION
from hil.registers.register_map import grouped
from hil.registers.ring import Ring
from hil.source.channel import Channel
from hil.source.episode import QUIET_S, Episode
from hil.source.line import DeviceLine
from hil.source.polling import HEARTBEAT_S, Schedule, check_rate
from hil.source.quality import Episodes
from hil.source.sample import LinkEvent, Reading, Sample, wall_at
from hil.source.statistics import Statistics
from hil.source.valve import BlockRead, Valve
from recordings import BadInput, SignalSpec

COUNTER, STEP = "sample_counter", "step"
"""The points that a map with a ring must have: the number of the newest sample, and the time between samples [s]."""

_WRAP = 1 << 32


class RingReading:
    """The plan of a source that reads every sample of the device's own clock.

    rate : how often per second it looks for new ones. The time of a sample is the device's: it is set against ours
    when the first sample comes, and goes on by `step` a sample, whether plant time follows the wall clock or not.
    quiet_s : how long the ring has to be read in time before overrunning it is over [s].
    """

    def __init__(self, rate: float = 10.0, quiet_s: float = QUIET_S) -> None:
        self._rate, self._quiet_s = check_rate(rate), quiet_s

    def signals(self, valve: Valve) -> tuple[SignalSpec, ...]:
        """What a recording of the valve declares."""
        return valve.signals(_ring(valve).points)

    def check(self, valve: Valve) -> None:
        """Raises BadInput when the valve's map has no ring, or not the points that belong to one."""
        _ring(valve)
        for name in (COUNTER, STEP):
            valve.map.point(name)

    async def run(self, valves: Sequence[Valve], line: DeviceLine, channel: Channel, statistics: Statistics) -> None:
        """Fetch until cancelled."""
        schedule = Schedule(self._rate, statistics)
        readers = [_Reader(valve, line, channel, statistics, self._quiet_s) for valve in valves]
        while True:
            await schedule.wait()
            await channel.room()
            for reader in readers:
                await reader.catch_up()


@dataclass
class _Clock:
    """Our time of the device's samples: sample number `number` was at `time` [s, monotonic] and `wall` [s, POSIX]."""

    number: int
    time: float
    wall: float
    step: float

    def at(self, number: int) -> tuple[float, float]:
        since = (number - self.number) * self.step
        return self.time + since, self.wall + since


class _Reader:
    """One valve's ring, and how far it has been read."""

    def __init__(
        self, valve: Valve, line: DeviceLine, channel: Channel, statistics: Statistics, quiet_s: float
    ) -> None:
        self._valve, self._line, self._channel, self._statistics = valve, line, channel, statistics
        self._ring, points = _ring(valve), [valve.map.point(COUNTER), valve.map.point(STEP)]
        self._heads = [BlockRead(block) for block in grouped(points, valve.map.max_hole, valve.map.max_read)]
        self._episodes = Episodes()
        self._clock: _Clock | None = None
        self._next = 0  # number of the sample to fetch next; it does not wrap around when the device's does
        self._last_time, self._moved_at, self._stall_reported = -math.inf, math.inf, False
        self._overrun, self._quiet_s = cast("Episode | None", None), quiet_s

    async def catch_up(self) -> None:
        """Fetch all that is new."""
        newest = await self._newest()
        if newest is None or not self._line.reachable(self._valve):
            return
        self._watch_counter(newest)
        while self._behind(newest) > 0:
            taken = await self._fetch(self._behind(newest))
            if taken == 0:
                return  # overwritten meanwhile, or no answer: the next look finds out
            await self._channel.room()

    async def _newest(self) -> int | None:
        """The number of the device's newest sample; the first one, and one that goes back, sets the clock."""
        loop = asyncio.get_running_loop()
        started, readings = loop.time(), dict[str, Reading]()
        for head in self._heads:
            if self._line.rests(head.request.unit) is not None:
                return None
            reply = await self._line.ask(head.request)
            readings.update(head.readings(reply))
        counter, step = readings[COUNTER], readings[STEP]
        if not (counter.good and step.good and step.value > 0):
            return None
        newest, now = int(counter.value), (started + loop.time()) / 2
        behind, exact = self._behind(newest), float(f"{step.value:.6g}")  # a float32 says 0.0024999999 for 0.0025
        if self._clock is None or behind < 0 or self._clock.step != exact:
            self._set_clock(newest, now, exact)
        elif behind > self._ring.samples - self._margin:
            self._skip(behind - (self._ring.samples - self._margin), now)
        elif self._overrun is not None and self._overrun.over(now, self._quiet_s):
            self._caught_up(self._overrun)
        return newest

    @property
    def _margin(self) -> int:
        """Samples that may be overwritten while a read is under way."""
        return self._ring.samples // 8

    def _behind(self, newest: int) -> int:
        """How many samples are there to fetch; negative when the device has started to count anew."""
        behind = (newest + 1 - self._next) % _WRAP
        return behind - _WRAP if behind >= _WRAP // 2 else behind

    def _set_clock(self, newest: int, now: float, step: float) -> None:
        if self._clock is not None:
            found = f"sample {self._next} every {self._clock.step:g} s was expected, it is at {newest} every {step:g} s"
            self._tell("gap", f"the device counts anew: {found}")
            now = max(now, self._last_time + step)
        self._clock, self._next = _Clock(newest, now, wall_at(now), step), newest

    def _skip(self, n_samples: int, now: float) -> None:
        """The ring was overrun."""
        first = self._next
        self._next += n_samples
        if self._overrun is not None:
            self._overrun.again(now, n_samples)
            return
        self._overrun = Episode.begin(now, n_samples)
        lost = f"samples {first} to {first + n_samples - 1} are lost, {n_samples} in all"
        self._tell("gap", f"the ring was overrun: {lost}")

    def _caught_up(self, past: Episode) -> None:
        self._overrun = None
        if past.more:
            found = f"{past.n} samples were lost in {past.lasted_s:.1f} s"
            self._tell("gap", f"the ring is read in time again; {found}")

    def _watch_counter(self, newest: int) -> None:
        now = asyncio.get_running_loop().time()
        if self._behind(newest) > 0:
            self._moved_at, self._stall_reported = now, False
        elif now - self._moved_at > HEARTBEAT_S and not self._stall_reported:
            self._stall_reported = True
            self._tell("gap", f"the device has made no new sample for {now - self._moved_at:.1f} s")

    async def _fetch(self, most: int) -> int:
        """Fetch and yield samples from the next one on; returns how many."""
        points, unit = self._valve.map.points, self._valve.map.point(COUNTER).unit_id
        address, count, _ = self._ring.read_for(points, self._next, most, self._valve.map.max_read)
        reply = await self._line.ask(Request(unit, READ_FUNCTION[self._ring.table], address, count))
        if reply.fault is not None:
            return 0
        taken = 0
        for values in self._ring.decode(points, self._next, reply.words):
            if values is None or self._clock is None:
                break
            time, wall = self._clock.at(self._next)
            units = {name: self._valve.map.point(name).unit for name in values}
            readings = {name: Reading.of(value, units[name], time) for name, value in values.items()}
            self._yield(Sample(time, wall, self._valve.name, readings))
            self._next, taken = self._next + 1, taken + 1
        return taken

    def _yield(self, sample: Sample) -> None:
        self._last_time = sample.time
        for event in self._episodes.observe(sample):
            self._channel.put(event)
        self._channel.put(sample)
        self._statistics.samples += 1

    def _tell(self, kind: Literal["gap"], text: str) -> None:
        now = asyncio.get_running_loop().time()
        self._channel.put(LinkEvent(now, wall_at(now), self._valve.name, kind, text))


def _ring(valve: Valve) -> Ring:
    if valve.map.ring is None:
        remedy = "add a [ring] to the map if the device has one, or poll it instead"
        raise BadInput(f"register map '{valve.map.name}'", "it has no ring of samples", remedy)
    return valve.map.ring
