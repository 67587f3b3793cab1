"""The last stage of the demo: the monitor learns a served valve, a friction fault is injected, and the alarm comes."""

from __future__ import annotations

import asyncio
import json
import math
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from detector import Measurements, Watch, learn
from hil import (
    LinkEvent,
    LiveSource,
    Monitor,
    MonitorEvent,
    MonitorSession,
    Polling,
    RegisterMap,
    WriteMap,
    monitor_session,
    open_source,
    valves_of,
)
from recordings import BadInput, NegativeAnswer
from simulator import ValveModel
from simulator.damadics import Parameters

SPEED, RATE = 5.0, 50.0
"""Times real time of the served valve, and polls per second: ten samples per second of plant time."""

LEARN_S, BEFORE_S, PATIENCE_S = 18.0, 2.0, 20.0
"""Seconds of the clock: of learning, of watching before the fault, and until the alarm has to be there and named."""

FRICTION = {"lugre.fc": 464.0, "lugre.fs": 640.0}
"""The fault: four times the friction of the healthy valve [N]."""

Say = Callable[[str], None]


@dataclass(frozen=True)
class Watched:
    """What came of it. alarm_s : from the fault to the alarm [s of the clock]; named_s : to its name, None if it got
    none in time; fault : the name; events : the file with all events.
    """

    alarm_s: float
    named_s: float | None
    fault: str | None
    events: Path


def watch_stage(model: Path, out: Path, say: Say = print) -> Watched:
    """Watch a simulated valve with a model file until an injected friction fault is found. About half a minute.

    Everything runs on loopback and is ended before this returns. Raises NegativeAnswer when no alarm comes, or one
    before the fault.
    """
    known = ValveModel.read(model)
    served = Parameters()
    plant = {"diaphragm_area_m2": served.diaphragm_area, "stroke_m": served.stroke} | known.plant
    return asyncio.run(_stage(known.model_copy(update={"plant": plant}), out / "events.jsonl", say))


async def _stage(model: ValveModel, events: Path, say: Say) -> Watched:
    async with _served() as address, _moving(address) as plant:
        say(f"The monitor learns the valve behind {address} for {LEARN_S:.0f} s, at {SPEED:g} times real time.")
        learned, news = asyncio.Event(), asyncio.Queue[MonitorEvent]()

        def learner(data: Measurements) -> Watch:
            return learn(data, model, per_month=100.0)

        def told(valve: str, watch: Watch) -> None:
            say(watch.false_alarms.sentence)
            learned.set()

        source = open_source(address, valves_of(RegisterMap.load("damadics")), Polling(RATE))
        monitor = Monitor(source.signals, learner, LEARN_S, told=told)
        with events.open("w", encoding="utf-8") as file:

            def sink(event: MonitorEvent) -> None:
                print(event.json_line(), file=file, flush=True)
                news.put_nowait(event)

            session = asyncio.ensure_future(monitor_session(source, monitor, MonitorSession((sink,))))
            found = asyncio.ensure_future(_fault(plant, learned, news, events, say))
            try:
                await asyncio.wait((session, found), return_when=asyncio.FIRST_COMPLETED)
                if not found.done():
                    await session  # it never ends by itself: this raises what ended it
                    raise NegativeAnswer("the source ended before the fault was found")
                return await found
            finally:
                for task in (session, found):
                    task.cancel()
                await asyncio.gather(session, found, return_exceptions=True)


async def _fault(
    plant: LiveSource, learned: asyncio.Event, news: asyncio.Queue[MonitorEvent], events: Path, say: Say
) -> Watched:
    """Inject the fault and wait for the alarm and its name."""
    await learned.wait()
    await asyncio.sleep(BEFORE_S)
    while not news.empty():
        early = news.get_nowait()
        if early.kind == "alarm":
            raise NegativeAnswer(f"there was an alarm before the fault: {early.text}")
    for name, value in FRICTION.items():
        await plant.write("damadics", name, value)
    begun = asyncio.get_running_loop().time()
    say(f"Watching. Now the friction of the valve is raised to {FRICTION['lugre.fc']:.0f} N.")
    alarm_s: float | None = None
    try:
        async with asyncio.timeout(PATIENCE_S):
            while True:
                event = await news.get()
                if event.kind != "alarm":
                    continue
                passed = asyncio.get_running_loop().time() - begun
                say(f"Alarm {passed:.1f} s after the fault: {event.text}")
                alarm_s = passed if alarm_s is None else alarm_s
                if event.fault == "friction":
                    return Watched(alarm_s, passed, event.fault, events)
    except TimeoutError:
        if alarm_s is None:
            raise NegativeAnswer(f"no alarm came within {PATIENCE_S:.0f} s of the fault") from None
        return Watched(alarm_s, None, None, events)


@asynccontextmanager
async def _served() -> AsyncIterator[str]:
    """`bristle serve` in a process of its own; its address."""
    options = ("--friction", "lugre", "--noise", "--speed", f"{SPEED:g}", "--allow-faults")
    command = (sys.executable, "-m", "bristle", "serve", "--listen", "tcp://127.0.0.1:0", *options)
    process: Process = await asyncio.create_subprocess_exec(*command, stdout=PIPE)
    try:
        if process.stdout is None or not (line := await process.stdout.readline()):
            raise BadInput("simulated valve", "it did not start", "try bristle serve by hand to see why")
        yield str(json.loads(line)["listening"][0])
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()


@asynccontextmanager
async def _moving(address: str) -> AsyncIterator[LiveSource]:
    """A second connection that moves the set point, as a process controller would; it can write to the valve."""
    valves = valves_of(RegisterMap.load("damadics"))
    write_map = WriteMap.load("damadics-write")
    plant = open_source(address, valves, Polling(1.0), write_map=write_map, allow_write=True)
    if not isinstance(plant, LiveSource):
        raise BadInput(address, "it is a recording", "a valve that can be moved is needed")
    async with plant:
        async for item in plant:
            if not isinstance(item, LinkEvent):
                break
        tasks = [asyncio.ensure_future(work) for work in (_drain(plant), _exercise(plant))]
        try:
            yield plant
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


async def _drain(plant: LiveSource) -> None:
    async for _ in plant:
        pass


async def _exercise(plant: LiveSource) -> None:
    """Two sines: the stem moves to and fro over its range, never twice in the same way."""
    loop = asyncio.get_running_loop()
    begun = loop.time()
    while True:
        t = SPEED * (loop.time() - begun)
        setpoint = 0.5 + 0.12 * math.sin(2.0 * math.pi * t / 14.0) + 0.08 * math.sin(2.0 * math.pi * t / 47.0)
        await plant.write("damadics", "setpoint", setpoint)
        await asyncio.sleep(0.1)
