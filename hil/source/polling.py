"""Reading every point of every valve once a period: the schedule, and a sample from the replies."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence

from hil.modbus.messages import ReplyFault
from hil.source.channel import Channel
from hil.source.episode import QUIET_S, Episode
from hil.source.line import DeviceLine
from hil.source.quality import Episodes, Heartbeat
from hil.source.sample import LinkEvent, Reading, Sample, wall_at
from hil.source.statistics import Statistics
from hil.source.valve import Valve
from recordings import BadInput, SignalSpec

HEARTBEAT_S = 2.0
QUIET_PERIODS = 10
"""Deadlines that have to be kept in a row before missing them is over."""
IDLE_S = 0.02
"""How long a source without a rate waits when there is nobody to ask."""


class Schedule:
    """Deadlines at a fixed rate; those that pass while the work goes on are counted and left out, never caught up.

    rate : per second, None for as fast as possible; statistics : where rounds, lateness and misses are counted;
    quiet_s : how long deadlines have to be kept before missing them is over [s].
    """

    def __init__(self, rate: float | None, statistics: Statistics, quiet_s: float = QUIET_S) -> None:
        self._period = None if rate is None else 1.0 / rate
        self._quiet_s = quiet_s if rate is None else max(quiet_s, QUIET_PERIODS / rate)
        self._statistics = statistics
        self._loop = asyncio.get_running_loop()
        self._due = self._loop.time()
        self._misses: Episode | None = None
        self._news: str | None = None

    async def wait(self) -> None:
        """Wait for the next deadline."""
        if self._period is None:
            self._statistics.polls += 1
            return
        await asyncio.sleep(self._due - self._loop.time())
        self._statistics.polls += 1
        late = max(self._loop.time() - self._due, 0.0)
        missed = int(late / self._period)
        self._statistics.lateness.add(late)
        self._statistics.missed += missed
        self._note(missed, late)
        self._due += (1 + missed) * self._period

    def misses(self) -> str | None:
        """What to tell of missed deadlines: when they begin, and when none was missed for a while; None for nothing."""
        news, self._news = self._news, None
        return news

    def _note(self, missed: int, late: float) -> None:
        now, past = self._loop.time(), self._misses
        if missed and past is None:
            self._misses = Episode.begin(now, missed)
            self._news = f"{missed} deadline{'s' if missed > 1 else ''} missed: a round began {late:.3g} s late"
        elif missed and past is not None:
            past.again(now, missed)
        elif past is not None and past.over(now, self._quiet_s):
            self._misses = None
            if past.more:
                self._news = f"deadlines are kept again; {past.n} were missed in {past.lasted_s:.1f} s"


def check_rate(rate: float | None) -> float | None:
    """The rate itself; BadInput when it is none that can be kept."""
    if rate is None or 0.0 < rate < math.inf:
        return rate
    raise BadInput("rate", f"it is {rate}", "give a finite number of rounds per second, more than 0")


class Polling:
    """The plan of a source that reads everything once a period.

    rate : rounds per second, None for as fast as possible; heartbeat : name of the point that must change, else the
    map's own; heartbeat_s : how long it may stand still; quiet_s : see `Schedule`. Raises BadInput for a rate that
    cannot be.
    """

    def __init__(
        self,
        rate: float | None,
        heartbeat: str | None = None,
        heartbeat_s: float = HEARTBEAT_S,
        quiet_s: float = QUIET_S,
    ) -> None:
        self._rate, self._heartbeat, self._heartbeat_s = check_rate(rate), heartbeat, heartbeat_s
        self._quiet_s = quiet_s

    def signals(self, valve: Valve) -> tuple[SignalSpec, ...]:
        """What a recording of the valve declares."""
        return valve.signals()

    def check(self, valve: Valve) -> None:
        """Raises BadInput when the plan does not fit the valve's map."""
        if self._heartbeat is not None:
            valve.map.point(self._heartbeat)

    async def run(self, valves: Sequence[Valve], line: DeviceLine, channel: Channel, statistics: Statistics) -> None:
        """Poll until cancelled."""
        rounds = [_Round(valve, line, self._pulse(valve)) for valve in valves]
        schedule = Schedule(self._rate, statistics, self._quiet_s)
        while True:
            await schedule.wait()
            await channel.room()
            asked = False
            for one in rounds:
                asked |= await one.sample(channel, statistics)
            misses = schedule.misses()
            if misses:
                now = asyncio.get_running_loop().time()
                for valve in valves:
                    channel.put(LinkEvent(now, wall_at(now), valve.name, "deadline_missed", misses))
            if not asked and self._rate is None:
                await asyncio.sleep(IDLE_S)

    def _pulse(self, valve: Valve) -> Heartbeat | None:
        name = self._heartbeat or valve.map.heartbeat
        return None if name is None else Heartbeat(name, self._heartbeat_s)


class _Round:
    """What one valve needs in every round, and what is remembered of it between rounds."""

    def __init__(self, valve: Valve, line: DeviceLine, heartbeat: Heartbeat | None) -> None:
        self._valve, self._line, self._heartbeat = valve, line, heartbeat
        self._episodes = Episodes()

    async def sample(self, channel: Channel, statistics: Statistics) -> bool:
        """Read the valve and put its sample; returns whether anything was asked."""
        if not self._line.link.open:
            return False
        started = asyncio.get_running_loop().time()
        readings, asked = await self._readings()
        if readings is None:
            return False
        if not self._line.reachable(self._valve) and not any(one.good for one in readings.values()):
            return asked
        now = asyncio.get_running_loop().time()
        moment = (started + now) / 2 if self._line.link.open else now  # not before the event that says it was lost
        checked = self._heartbeat.check(moment, readings) if self._heartbeat else readings
        sample = Sample(moment, wall_at(moment), self._valve.name, checked)
        for event in self._episodes.observe(sample):
            channel.put(event)
        channel.put(sample)
        statistics.samples += 1
        return asked

    async def _readings(self) -> tuple[Mapping[str, Reading] | None, bool]:
        """Every point's reading, and whether anything was asked; None when no device of the valve is listened to, or
        the connection broke before anything was good. What was good before it broke stays good.
        """
        readings: dict[str, Reading] = {}
        asked = listening = False
        lost: str | None = None
        for read in self._valve.reads:
            listening |= self._line.listens(read.request.unit)
            resting = lost or self._line.rests(read.request.unit)
            if resting is not None:
                readings.update(read.bad(resting))
                continue
            reply = await self._line.ask(read.request)
            asked = True
            readings.update(read.readings(reply))
            lost = reply.text if reply.fault is ReplyFault.LOST else None
        if lost and not any(one.good for one in readings.values()):
            return None, False
        return (readings if asked or listening else None), asked
