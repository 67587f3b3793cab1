"""The last stage of the demo: the monitor learns a served valve, a friction fault is injected, and the alarm comes.

A live page shows it meanwhile, and afterwards for as long as it is wanted.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path

from bristle.cli.demo.drive import LOOK_S, DemoDrive
from bristle.cli.demo.record import Say
from bristle.cli.demo.valve import (
    DATA_SHEET,
    FRICTION,
    HUM_SAMPLES,
    LONGEST_S,
    READS_PER_SECOND,
    STEP_S,
    VALVE,
    controller,
    ring,
    served,
    terminable,
)
from detector import Promise, Watch
from hil import (
    LiveSource,
    Monitor,
    MonitorEvent,
    MonitorSession,
    Page,
    PageSettings,
    ShownMonitor,
    monitor_session,
)
from recordings import NegativeAnswer
from simulator import ValveModel

SPEED = 4.0
"""Times real time of the served valve, at most. The samples have its own clock, so that the model fits as it is."""

LEARN_S, BEFORE_S = 80.0, 8.0
"""Plant time of learning, and of watching before the fault [s]."""

PATIENCE_S = 120.0
"""Plant time until the alarm has to be there and named [s]."""

WORSE = 2.0
"""The fault: so many times the friction of the healthy valve."""

KEPT_S = 30 * 86400.0
"""A valve that is kept ends by itself after so long [s]: a month."""

FALSE_ALARMS = 1.0
"""A month are wished; what the learning time supports is said."""


@dataclass(frozen=True)
class DemoWatch:
    """What came of it. alarm_s : plant time from the fault to the alarm [s]; fault : its name, None if it got none in
    time; events : the file with all events; false_alarms : how often one is to be expected; page : where the live page
    is.
    """

    alarm_s: float
    fault: str | None
    events: Path
    false_alarms: Promise
    page: str


Ending = Callable[[DemoWatch], None]
"""Told what came of it, while everything still runs."""


def watch_stage(model: Path, out: Path, say: Say, ending: Ending, keep: bool = False) -> None:
    """Watch the simulated valve with a model file until an injected friction fault is found.

    Everything runs on loopback and is ended before this returns; with `keep` that is when it is interrupted. Raises
    NegativeAnswer when no alarm comes, or one before the fault.
    """
    known = ValveModel.read(model)
    known = known.model_copy(update={"plant": DATA_SHEET.known() | known.plant})
    with terminable():
        asyncio.run(_stage(known, out / "events.jsonl", say, ending, keep))


async def _stage(model: ValveModel, events: Path, say: Say, ending: Ending, keep: bool) -> None:
    longest_s = KEPT_S if keep else LONGEST_S
    async with served(allow_faults=True, longest_s=longest_s) as address, controller(address) as plant:
        await _watched(address, plant, model, events, say, ending, keep)


def setpoint(t: float) -> float:
    """Two sines of plant time: the stem moves to and fro over its range, never twice in the same way."""
    return 0.5 + 0.2 * math.sin(2 * math.pi * t / 8.0) + 0.1 * math.sin(t / 2.6)


async def _watched(
    address: str, plant: LiveSource, model: ValveModel, events: Path, say: Say, ending: Ending, keep: bool
) -> None:
    say(f"The monitor learns the valve behind {address} for {LEARN_S:.0f} s, which pass up to {SPEED:g} times as fast.")
    learned: asyncio.Future[Promise] = asyncio.get_running_loop().create_future()
    news = asyncio.Queue[MonitorEvent]()

    def on_learned(valve: str, watch: Watch) -> None:
        learned.set_result(watch.false_alarms)

    source = ring(address)
    drive = DemoDrive(plant, source, setpoint, SPEED)
    monitor = Monitor.with_model(source.signals, model, FALSE_ALARMS, LEARN_S, on_learned=on_learned)
    shown = ShownMonitor("bristle demo", address, READS_PER_SECOND, monitor, model)
    with events.open("w", encoding="utf-8") as file, Page(PageSettings(), shown) as page:
        say(f"The live page is at {page.url}")

        def sink(event: MonitorEvent) -> None:
            print(event.json_line(), file=file, flush=True)
            news.put_nowait(event)

        session = asyncio.ensure_future(monitor_session(source, monitor, MonitorSession((sink,), taken=shown.take)))
        driven = asyncio.ensure_future(drive.run())
        found = asyncio.ensure_future(_fault(plant, drive, monitor, learned, news, events, page.url, say))
        looked_at = asyncio.ensure_future(page.always())
        try:
            await asyncio.wait((session, found, driven), return_when=asyncio.FIRST_COMPLETED)
            if driven.done():
                await driven  # raises what ended the link
            if found.done():
                ending(await found)
                if keep:
                    say(f"The page stays at {page.url} until Ctrl-C.")
                    await session
                return
            if (await session).stopped_by is not None:  # it never ends by itself; else this raises what ended it
                raise KeyboardInterrupt
            raise NegativeAnswer("the monitor ended before the fault was found")
        finally:
            running = (session, driven, found, looked_at)
            for task in running:
                task.cancel()
            await asyncio.gather(*running, return_exceptions=True)


async def _fault(
    plant: LiveSource, drive: DemoDrive, monitor: Monitor, learned: asyncio.Future[Promise],
    news: asyncio.Queue[MonitorEvent], events: Path, page: str, say: Say,
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
    began = drive.seconds
    say(f"Watching. Now the friction of the valve is raised from {FRICTION['lugre.fc']:.0f} N, {WORSE:g} times.")
    alarm_s: float | None = None
    async for event in _alarms(news, drive, began + PATIENCE_S):
        passed = max(event.t_s - began, 0.0)
        say(f"Alarm {passed:.1f} s after the fault: {event.text}")
        alarm_s = passed if alarm_s is None else alarm_s
        if event.fault == "friction":
            return DemoWatch(alarm_s, event.fault, events, promise, page)
    if alarm_s is None:
        raise NegativeAnswer(f"no alarm came within {PATIENCE_S:.0f} s of the fault")
    return DemoWatch(alarm_s, None, events, promise, page)


async def _alarms(news: asyncio.Queue[MonitorEvent], drive: DemoDrive, until: float) -> AsyncIterator[MonitorEvent]:
    """Alarms as they come, until so much plant time [s] has passed."""
    while drive.seconds < until:
        try:
            event = await asyncio.wait_for(news.get(), LOOK_S)
        except TimeoutError:
            continue
        if event.kind == "alarm":
            yield event


async def _after_samples(monitor: Monitor, n_samples: int) -> None:
    """Wait until so many more samples were checked."""
    enough = monitor.status[0].samples + n_samples
    while monitor.status[0].samples < enough:
        await asyncio.sleep(0.05)
