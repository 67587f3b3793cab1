"""A plant that is told what to show, behind a real page in its process, for the tests of the page."""

from __future__ import annotations

import asyncio
import math
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from hil import MonitorEvent
from hil.page import Page, PageSettings
from hil.running import LoopThread
from hil.service.in_service.figures import Histogram, InServiceFigures, SignatureCurve, Trended
from hil.service.status import Health, LinkStatus, PlantStatus, RecentSamples, TaskStatus, ValveStatus
from identification.standard_tests import Interval

BEGAN = datetime(2026, 11, 23, 8, 0, tzinfo=UTC)
RATE = 10.0
PATIENCE_S = 120.0


def link(**other) -> LinkStatus:
    usual = LinkStatus("tcp://127.0.0.1:5020", True, 0.05, 12_000, 0, 3, 1, "Every poll is answered.")
    return replace(usual, **other)


def valve(tag: str, health: Health = Health.GOOD, **other) -> ValveStatus:
    usual = ValveStatus(
        tag, health, "nothing above its limit", BEGAN, (), (), link(),
        latest={"position": 0.0191234, "setpoint": 0.507, "pressure": 123_400.0}, phase="watching", load=0.2,
    )  # fmt: skip
    return replace(usual, **other)


def figures() -> InServiceFigures:
    friction = Trended(Interval(251.3, 240.1, 262.9), "N", Interval(3.1, 1.2, 5.0), 12, BEGAN)
    return InServiceFigures(
        BEGAN, 36_000.0, Histogram((0.0, 50.0, 100.0), (1800.0, 1800.0), "%"),
        Histogram((0.0, 50.0, 100.0), (70.0, 9.0), "%"), 812.4, 1034, friction=friction,
        signature=SignatureCurve((0.0, 50.0, 100.0), (20.0, 60.0, 100.0), (10.0, 50.0, 90.0), "kPa"),
        dead_band=Trended(Interval(0.61, 0.55, 0.68), "%", None, 3, BEGAN), steps=4,
        notes=("The spring rate needs the diaphragm area.",),
    )  # fmt: skip


class Shown:
    """What the page is told. Valves may be exchanged at any time; `silent` lets no more samples come."""

    def __init__(self, *valves: ValveStatus) -> None:
        self.valves = {one.tag: one for one in valves}
        self.tasks = [TaskStatus("acquisition", True, 0, "", 0)]
        self.began = time.time()
        self.stopped_at: float | None = None
        self.hold = 0.0

    def put(self, *valves: ValveStatus) -> None:
        self.valves |= {one.tag: one for one in valves}

    def status(self) -> PlantStatus:
        time.sleep(self.hold)
        return PlantStatus("Unit 7 <b>", datetime.now(UTC), tuple(self.valves.values()), tuple(self.tasks))

    def recent(self, tag: str) -> RecentSamples:
        if tag not in self.valves:
            raise KeyError(tag)
        t = np.arange(self.began - 60.0, self.stopped_at or time.time(), 1.0 / RATE)
        wanted = 0.019 + 0.008 * np.sin(2 * math.pi * (t - self.began) / 14.0)
        position = wanted - 0.0004 * np.sign(np.cos(2 * math.pi * (t - self.began) / 14.0))
        force = 1950.0 + 1.17e5 * position + 150.0 * np.sign(np.cos(2 * math.pi * (t - self.began) / 14.0))
        residual = 0.4 + 0.2 * np.sin(t / 3.0)
        return RecentSamples(t, position, wanted, force, residual, np.ones(len(t)))


def alarmed(tag: str) -> ValveStatus:
    event = MonitorEvent(
        70.0,
        BEGAN.timestamp() + 70.0,
        tag,
        "alarm",
        "the friction has changed; test 'fc' at 2.5, limit 1",
        "friction",
        2.5,
        1.0,
    )
    return valve(
        tag, Health.MAINTENANCE, reason="the friction has changed", since=BEGAN + timedelta(seconds=70),
        evidence=("test 'fc' at 2.5, limit 1",), check=("packing: too tight, dry or worn", "stem: bent or scored"),
        events=(MonitorEvent(1.0, BEGAN.timestamp(), tag, "link_up", "the device answers"), event), load=2.5,
        figures=figures(),
    )  # fmt: skip


@contextmanager
def served(shown: Shown, settings: PageSettings | None = None, recordings: Path | None = None) -> Iterator[Page]:
    """A page in its process, while the context lasts."""
    with Page(settings or PageSettings(), shown, recordings) as page:
        loop = LoopThread("page of a test")
        task = loop.start(page.always())
        try:
            urllib.request.urlopen(f"{page.url}alive", timeout=PATIENCE_S).close()  # its process is there
            yield page
        finally:
            loop.run(_cancelled(task))
            loop.close()


async def _cancelled(task: asyncio.Task) -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
