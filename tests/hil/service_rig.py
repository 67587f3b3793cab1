"""A plant of small devices whose every value is known, and a service over it, for the tests of the service."""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
from monitor_rig import model_file

from hil import PlantFile, Service, ServiceOutlets, ServicePlan

MAP = """
name = "small"
heartbeat = "counter"
[[points]]
name = "position"
table = "input"
address = 0
type = "float32"
unit = "mm"
valid_range = [0.0, 40.0]
[[points]]
name = "counter"
table = "input"
address = 2
type = "uint16"
[[points]]
name = "setpoint"
table = "input"
address = 3
type = "float32"
unit = "1"
"""

PATIENCE = 300.0
"""Longest time anything may take [s]; it only ends what hangs."""


def position_mm(counter: float | np.ndarray) -> float | np.ndarray:
    """Where the stem is when the counter says so, as the device's single precision has it."""
    return np.float32(19.0 + 6.0 * np.sin(np.asarray(counter) / 25.0))


class Swinging:
    """Answers for any number of units; the counter moves with every read of a unit."""

    def __init__(self) -> None:
        self.counters: dict[int, int] = {}
        self.functions: set[int] = set()
        self.silent = False

    def __call__(self, unit: int, function: int, address: int, count: int) -> Sequence[int] | int | None:
        self.functions.add(function)
        if self.silent:
            return None
        if (function, address, count) != (4, 0, 5):
            return 2
        n = self.counters[unit] = (self.counters.get(unit, 0) + 1) % 65536
        position, setpoint = float(position_mm(n)), 0.5 + 0.16 * math.sin(n / 25.0)
        return [*_words(position), n, *_words(setpoint)]


def _words(value: float) -> tuple[int, int]:
    return struct.unpack(">2H", struct.pack(">f", value))


def plant_file(
    folder: Path, port: int, valves: int = 1, rate_hz: float = 20.0, more: str = "", timeout_s: float = 2.0
) -> Path:
    """A plant of valves V1, V2, ... behind one port; they learn for ever. more : further tables."""
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "model.json").exists():
        model_file(folder)
        (folder / "map.toml").write_text(MAP)
    lines = [
        'name = "Rig"',
        "[[source]]",
        f'address = "tcp://127.0.0.1:{port}?timeout={timeout_s}"',
        f"rate_hz = {rate_hz}",
    ]
    for unit in range(1, valves + 1):
        lines += ["[[source.valve]]", f'tag = "V{unit}"', 'map = "map.toml"', 'model = "model.json"']
        lines += [f"unit = {unit}", "learn_s = 1e6"]
    (folder / "plant.toml").write_text("\n".join(lines) + "\n" + more)
    return folder / "plant.toml"


def plan_of(path: Path) -> ServicePlan:
    return ServicePlan.of(PlantFile.read(path))


@asynccontextmanager
async def running(plan: ServicePlan, outlets: ServiceOutlets | None = None) -> AsyncIterator[Service]:
    """A service while the block lasts."""
    service, stop = Service(plan, outlets), asyncio.Event()
    task = asyncio.create_task(service.run(stop))
    try:
        yield service
    finally:
        stop.set()
        await asyncio.wait_for(task, PATIENCE)


async def until(condition: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
    """Wait for a condition; the time only ends a test that hangs."""
    try:
        async with asyncio.timeout(patience):
            while not condition():
                await asyncio.sleep(0.02)
    except TimeoutError:
        raise AssertionError(f"it did not happen: {what}") from None
