"""The last stage of the demo: the monitor learns a served valve, a friction fault is injected, and the alarm comes."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass
from pathlib import Path

from bristle.cli.demo.record import Say
from bristle.cli.demo.valve import (
    DATA_SHEET,
    FRICTION,
    HUM_SAMPLES,
    STEP_S,
    VALVE,
    controller,
    moving,
    ring,
    served,
    terminable,
)
from detector import Promise, Watch
from hil import LiveSource, Monitor, MonitorEvent, MonitorSession, monitor_session
from recordings import NegativeAnswer
from simulator import ValveModel

SPEED = 4.0
"""Times real time of the served valve. The samples have its own clock, so that the model fits as it is."""

LEARN_S, BEFORE_S = 80.0, 8.0
"""Plant time of learning, and of watching before the fault [s]."""

PATIENCE_S = 40.0
"""Seconds of the clock until the alarm has to be there and named. On a busy machine samples are lost, and after each
loss the detector waits for a second of plant time.
"""

WORSE = 2.0
"""The fault: so many times the friction of the healthy valve."""

FALSE_ALARMS = 1.0
"""A month are wished; what the learning time supports is said."""


@dataclass(frozen=True)
class DemoWatch:
    """What came of it. alarm_s : from the fault to the alarm [s of the clock]; named_s : to its name, None if it got
    none in time; fault : the name; events : the file with all events; false_alarms : how often one is to be expected.
    """

    alarm_s: float
    named_s: float | None
    fault: str | None
    events: Path
    false_alarms: Promise


def watch_stage(model: Path, out: Path, say: Say = print) -> DemoWatch:
    """Watch the simulated valve with a model file until an injected friction fault is found.

    Everything runs on loopback and is ended before this returns. Raises NegativeAnswer when no alarm comes, or one
    before the fault.
    """
    known = ValveModel.read(model)
    known = known.model_copy(update={"plant": DATA_SHEET.known() | known.plant})
    with terminable():
        return asyncio.run(_stage(known, out / "events.jsonl", say))


async def _stage(model: ValveModel, events: Path, say: Say) -> DemoWatch:
    async with (
        served("--speed", f"{SPEED:g}", "--allow-faults") as address,
        controller(address) as plant,
        moving(plant, setpoint, SPEED),
    ):
        return await _watched(address, plant, model, events, say)


def setpoint(t: float) -> float:
    """Two sines of plant time: the stem moves to and fro over its range, never twice in the same way."""
    return 0.5 + 0.2 * math.sin(2 * math.pi * t / 8.0) + 0.1 * math.sin(t / 2.6)


async def _watched(address: str, plant: LiveSource, model: ValveModel, events: Path, say: Say) -> DemoWatch:
    say(f"The monitor learns the valve behind {address} for {LEARN_S / SPEED:.0f} s, at {SPEED:g} times real time.")
    learned: asyncio.Future[Promise] = asyncio.get_running_loop().create_future()
    news = asyncio.Queue[MonitorEvent]()

    def on_learned(valve: str, watch: Watch) -> None:
        learned.set_result(watch.false_alarms)

    source = ring(address)
    monitor = Monitor.with_model(source.signals, model, FALSE_ALARMS, LEARN_S, on_learned=on_learned)
    with events.open("w", encoding="utf-8") as file:

        def sink(event: MonitorEvent) -> None:
            print(event.json_line(), file=file, flush=True)
            news.put_nowait(event)

        session = asyncio.ensure_future(monitor_session(source, monitor, MonitorSession((sink,))))
        found = asyncio.ensure_future(_fault(plant, monitor, learned, news, events, say))
        try:
            await asyncio.wait((session, found), return_when=asyncio.FIRST_COMPLETED)
            if found.done():
                return await found
            if (await session).stopped_by is not None:  # it never ends by itself; else this raises what ended it
                raise KeyboardInterrupt
            raise NegativeAnswer("the monitor ended before the fault was found")
        finally:
            for task in (session, found):
                task.cancel()
            await asyncio.gather(session, found, return_exceptions=True)


async def _fault(
    plant: LiveSource, monitor: Monitor, learned: asyncio.Future[Promise], news: asyncio.Queue[MonitorEvent],
    events: Path, say: Say,
) -> DemoWatch:  # fmt: skip
    """Inject the fault when the healthy valve was watched for a while, and wait for the alarm and its name."""
    promise = await learned
    say(promise.sentence)
    await _after_samples(monitor, round(BEFORE_S / (HUM_SAMPLES * STEP_S)))
    while not news.empty():
        early = news.get_nowait()
        if early.kind == "alarm":
            raise NegativeAnswer(f"there was an alarm before the fault: {early.text}")
    for name, value in FRICTION.items():
        await plant.write(VALVE, name, WORSE * value)
    began = asyncio.get_running_loop().time()
    say(f"Watching. Now the friction of the valve is raised from {FRICTION['lugre.fc']:.0f} N, {WORSE:g} times.")
    alarm_s: float | None = None
    try:
        async with asyncio.timeout(PATIENCE_S):
            while True:
                event = await news.get()
                if event.kind != "alarm":
                    continue
                passed = asyncio.get_running_loop().time() - began
                say(f"Alarm {passed:.1f} s after the fault: {event.text}")
                alarm_s = passed if alarm_s is None else alarm_s
                if event.fault == "friction":
                    return DemoWatch(alarm_s, passed, event.fault, events, promise)
    except TimeoutError:
        if alarm_s is None:
            raise NegativeAnswer(f"no alarm came within {PATIENCE_S:.0f} s of the fault") from None
        return DemoWatch(alarm_s, None, None, events, promise)


async def _after_samples(monitor: Monitor, n_samples: int) -> None:
    """Wait until so many more samples were checked."""
    enough = monitor.status[0].samples + n_samples
    while monitor.status[0].samples < enough:
        await asyncio.sleep(0.05)
