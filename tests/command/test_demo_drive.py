"""What moves the demo's valve: plant time waits for a monitor that falls behind, so that nothing is lost."""

from __future__ import annotations

import asyncio

import pytest

from bristle.cli.demo import drive
from bristle.cli.demo.drive import AHEAD_S, DemoDrive
from bristle.cli.demo.valve import MOVE_S, STEP_S

QUICK = 1e6
"""Times real time: the clock holds nothing up."""


class Monitor:
    """As the source of a monitor: how many samples it has taken. It takes them when it is told to."""

    def __init__(self) -> None:
        self.taken = 0


class Plant:
    """A valve in lock-step; `unwatched` : plant time [s] that was not watched yet, after every move."""

    def __init__(self, monitor: Monitor) -> None:
        self.monitor = monitor
        self.setpoints: list[float] = []
        self.made, self.unwatched, self.moves = 0, list[float](), 0

    async def write(self, valve: str, point: str, value: float) -> None:
        await asyncio.sleep(0)
        if point == "setpoint":
            self.setpoints.append(value)
            return
        self.made, self.moves = self.made + int(value), self.moves + 1
        self.unwatched.append((self.made - self.monitor.taken) * STEP_S)


async def driven(monitor: Monitor, plant: Plant, until) -> DemoDrive:
    """DemoDrive until something holds."""
    found = DemoDrive(plant, monitor, lambda t: t, QUICK)
    task = asyncio.ensure_future(found.run())
    try:
        async with asyncio.timeout(60.0):
            while not until():
                await asyncio.sleep(0)
                if task.done():
                    await task
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
    return found


def test_nothing_moves_before_the_monitor_is_there():
    monitor = Monitor()
    plant, turns = Plant(monitor), iter(range(200))
    found = asyncio.run(driven(monitor, plant, lambda: next(turns, None) is None))
    assert (plant.moves, found.seconds) == (0, 0.0)


def test_plant_time_waits_for_a_monitor_that_falls_behind(monkeypatch):
    monkeypatch.setattr(drive, "ALIVE_S", 1e6)
    monitor = Monitor()
    plant = Plant(monitor)
    monitor.taken = 1

    def until() -> bool:
        if plant.unwatched and plant.unwatched[-1] > AHEAD_S - MOVE_S / 2:  # it stands still: the monitor catches up
            monitor.taken = plant.made
        return plant.moves == 100

    found = asyncio.run(driven(monitor, plant, until))
    assert max(plant.unwatched) <= AHEAD_S + MOVE_S + STEP_S
    assert found.seconds == pytest.approx(100 * MOVE_S, abs=1.5 * MOVE_S)
    assert plant.setpoints[:100] == pytest.approx([k * MOVE_S for k in range(100)])


def test_a_monitor_that_learns_for_long_does_not_make_the_link_take_the_valve_for_dead(monkeypatch):
    monkeypatch.setattr(drive, "ALIVE_S", 0.0)
    monitor = Monitor()
    monitor.taken = 1
    plant = Plant(monitor)
    asyncio.run(driven(monitor, plant, lambda: plant.moves == 30))
    assert plant.unwatched[-1] > 2 * AHEAD_S
