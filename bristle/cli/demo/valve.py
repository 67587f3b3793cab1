"""The simulated hardware of the demo: a valve in a process of its own behind Modbus, on loopback, in lock-step.

Plant time moves only when it is told to, so that a busy machine sees the same samples as an idle one.
"""

from __future__ import annotations

import asyncio
import json
import math
import signal
import statistics
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager

from hil import (
    LinkEvent,
    LiveSource,
    Polling,
    Reading,
    RegisterMap,
    RingReading,
    Sample,
    Source,
    SourceWrapper,
    WriteMap,
    open_source,
    valves_of,
)
from recordings import BadInput, Plant

MAP, VALVE = "damadics", "damadics"
"""The register map, and the name of the valve in it."""

DATA_SHEET = Plant(moving_mass_kg=2.0, stroke_m=0.0381, diaphragm_area_m2=0.029)
"""What is known of the valve."""

HIDDEN = "position_periodic_force:a=35,b=0,pitch=0.006"
"""What nobody is told of it, and is to be traced: coils of the spring that rub on the rod, every 6 mm with 35 N."""

FRICTION = {"lugre.fc": 250.0, "lugre.fs": 325.0}
"""Friction of the healthy valve [N]: a packing that was tightened well."""

SETTINGS = {
    "upstream_pressure": 2.6e6, "downstream_pressure": 2.6e6,  # isolated: no flow pushes on the plug
    "conductance": 2e-5, "supply_pressure": 3e5, "gain": 10.0,  # quick and smooth: a stroke takes two seconds
    "spring_rate": 1.2e5, "lugre.sigma2": 6000.0, "lugre.vs": 3e-3,
} | FRICTION  # fmt: skip

SEED = 1
"""Of the noise."""

STEP_S = 0.0025
"""Plant time between two samples of the valve's ring [s]."""

HUM_SAMPLES = 8
"""Samples in a period of the mains, 20 ms: their mean knows nothing of its hum."""

MOVE_S = 0.1
"""Plant time between two set points [s]."""

READS_PER_SECOND = 50.0
"""How often per second the ring is read."""

LONGEST_S = 3600
"""The served valve ends by itself after so long, whatever became of the demo [s]."""


@contextmanager
def terminable() -> Iterator[None]:
    """Meanwhile SIGTERM is an interruption like Ctrl-C, so that the served valve is ended too."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@asynccontextmanager
async def served(*, allow_faults: bool = False, longest_s: float = LONGEST_S) -> AsyncIterator[str]:
    """The valve of the demo, served in a process of its own, in lock-step; its address. It has gone when this is left.

    allow_faults : its friction can be changed by register; longest_s : it ends by itself after so long [s]. Raises
    BadInput when it does not start.
    """
    settings = [f"{name}={value!r}" for name, value in SETTINGS.items()]
    about = {"settings": settings, "effects": [HIDDEN], "seed": SEED}
    words = json.dumps([about, allow_faults, longest_s])
    command = (sys.executable, "-m", "bristle.cli.demo.plant", words)
    process: Process = await asyncio.create_subprocess_exec(*command, stdout=PIPE, start_new_session=True)
    try:
        if process.stdout is None or not (line := await process.stdout.readline()):
            raise BadInput("simulated valve", "it did not start", "run bristle demo again to see why")
        yield str(json.loads(line)["listening"][0])
    finally:
        if process.returncode is None:
            process.terminate()
        await asyncio.shield(process.wait())


@asynccontextmanager
async def controller(address: str) -> AsyncIterator[LiveSource]:
    """A connection that can write to the valve, as that of a process controller."""
    write_map = WriteMap.load("damadics-write")
    valves = valves_of(RegisterMap.load(MAP))
    plant = open_source(address, valves, Polling(1.0), write_map=write_map, allow_write=True)
    if not isinstance(plant, LiveSource):
        raise BadInput(address, "it is a recording", "a valve that can be moved is needed")
    async with plant:
        async for item in plant:
            if not isinstance(item, LinkEvent):
                break
        reading = asyncio.ensure_future(_drain(plant))
        try:
            yield plant
        finally:
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)


async def moved(plant: LiveSource, setpoint: Callable[[float], float], seconds: float) -> None:
    """Let so much plant time [s] pass in lock-step, with a set point over it."""
    for k in range(round(seconds / MOVE_S)):
        await plant.write(VALVE, "setpoint", setpoint(k * MOVE_S))
        await plant.write(VALVE, "advance", round(MOVE_S / STEP_S))


async def _drain(plant: LiveSource) -> None:
    async for _ in plant:
        pass


def ring(address: str) -> Averaged:
    """Every sample that the valve keeps in its ring, as means over a period of the mains."""
    return Averaged(open_source(address, valves_of(RegisterMap.load(MAP)), RingReading(READS_PER_SECOND)), HUM_SAMPLES)


class Averaged(SourceWrapper):
    """A source whose samples are the means of `n` running ones of another; `taken` : how many of those there were."""

    def __init__(self, source: Source, n: int) -> None:
        super().__init__(source)
        self._n = n
        self._kept: list[Sample] = []
        self.taken = 0

    async def __anext__(self) -> Sample | LinkEvent:
        while len(self._kept) < self._n:
            item = await anext(self._source)
            if isinstance(item, LinkEvent):
                self._kept.clear()  # no mean reaches over a gap
                return item
            self._kept.append(item)
            self.taken += 1
        kept, self._kept = self._kept, []
        first, last = kept[0], kept[-1]
        readings = {name: _mean([one.readings[name] for one in kept]) for name in first.readings}
        return Sample((first.time + last.time) / 2, (first.wall + last.wall) / 2, first.valve, readings)


def _mean(readings: list[Reading]) -> Reading:
    bad = next((one for one in readings if not one.good), None)
    if bad is not None:
        return bad._replace(value=math.nan)
    value = statistics.fmean(one.value for one in readings)
    return Reading(value, readings[0].unit, time=statistics.fmean(one.time for one in readings))
