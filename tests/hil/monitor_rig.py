"""A served valve that is moved, and a monitor in a process of its own, for the tests of the live detector."""

from __future__ import annotations

import asyncio
import json
import math
import sys
from asyncio.subprocess import DEVNULL, PIPE, Process
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bristle.cli.demo.valve import VALVE, controller
from hil import LiveSource, Polling, RegisterMap, Sample, open_source, valves_of
from recordings import Recording, Signal, read, write
from simulator import Value, ValveModel
from simulator.damadics import Actuator, Noise, Parameters, Scenario, run, stimuli

SPEED, RATE = 5.0, 50.0
"""Times real time, and polls per second: ten samples per second of plant time."""

PATIENCE = 60.0
"""Longest time anything may take [s]."""

_VALUES = {
    "mass.m": (2.0 / SPEED**2, "kg"), "spring.K": (1.17e5, "N/m"), "spring.F0": (1950.0, "N"),
    "lugre.fc": (130.0, "N"), "lugre.fs": (170.0, "N"), "lugre.vs": (1e-3 * SPEED, "m/s"), "lugre.sigma0": (3e6, "N/m"),
    "lugre.sigma1": (3.5e3 / SPEED, "N s/m"), "lugre.sigma2": (1500.0 / SPEED, "N s/m"),
}  # fmt: skip


def setpoint(t: float | np.ndarray) -> float | np.ndarray:
    """Two sines of plant time: the stem moves to and fro over its range."""
    return 0.5 + 0.12 * np.sin(2 * math.pi * t / 14.0) + 0.08 * np.sin(2 * math.pi * t / 47.0)


def model_file(folder: Path) -> Path:
    """A model of the valve as it looks at that speed."""
    values = {name: Value(value=value, unit=unit) for name, (value, unit) in _VALUES.items()}
    plant: Mapping[str, float | str] = {"diaphragm_area_m2": 0.029, "stroke_m": 0.0381}
    model = ValveModel(effects=("inertia", "spring", "lugre"), parameters=values, plant=dict(plant))
    model.write(folder / "model.json")
    return folder / "model.json"


def healthy_file(folder: Path, seconds: float = 250.0) -> Path:
    """A fault-free recording of the valve, with the clock of the served one."""

    def stimulus(t: np.ndarray) -> np.ndarray:
        columns = stimuli.constant(0.5)(t)
        columns[:, 0] = setpoint(t)
        return columns

    scenario = Scenario("moved", "to and fro", stimulus, seconds, (), 0.1)
    made = run(scenario, Actuator("lugre", Parameters(), {}), Noise(3), duration=seconds, sample=0.1)[0]
    first = 100  # the chamber is full and the valve moves
    signals = [
        Signal(one.name, one.values[first:] / (SPEED if one.role == "time" else 1.0), one.unit, one.role)
        for one in made.signals.values()
        if one.name not in ("flow", "temperature")
    ]
    write(folder / "healthy.h5", type(made).of(signals, plant=made.plant))
    return folder / "healthy.h5"


def broken_file(healthy: Path, path: Path, after_s: float = 30.0) -> Path:
    """The healthy recording with a position sensor that reads 3 mm too much from some time on."""
    recording = read(healthy)
    wrong = np.where(recording.time - recording.time[0] > after_s, 3e-3, 0.0)
    signals = [
        Signal(one.name, one.values + wrong if one.name == "position" else one.values, one.unit, one.role)
        for one in recording.signals.values()
    ]
    write(path, Recording.of(signals, plant=recording.plant))
    return path


@dataclass
class Served:
    """`bristle serve` in its process: addresses as it says them, in the order asked for."""

    process: Process
    addresses: list[str]
    kept: list[asyncio.Task[None]] = field(default_factory=list)

    async def end(self, kill: bool = False) -> None:
        """Stop it, and wait until it has gone."""
        for task in self.kept:
            task.cancel()
        await asyncio.gather(*self.kept, return_exceptions=True)
        if self.process.returncode is None:
            self.process.kill() if kill else self.process.terminate()
        await self.process.wait()


async def serve(listen: Sequence[str], *more: str) -> Served:
    """Start the server and wait until it listens."""
    where = [word for address in listen for word in ("--listen", address)]
    options = ("--friction", "lugre", "--noise", "--speed", f"{SPEED:g}", "--allow-faults")
    command = (sys.executable, "-m", "bristle", "serve", *where, *options, *more)
    process = await asyncio.create_subprocess_exec(*command, stdout=PIPE, stderr=DEVNULL)
    line = await asyncio.wait_for(process.stdout.readline(), PATIENCE)
    return Served(process, json.loads(line)["listening"])


@asynccontextmanager
async def moved(address: str) -> AsyncIterator[LiveSource]:
    """A connection that moves the set point until it is left; it can write the fault registers."""
    async with controller(address) as plant:
        task = asyncio.ensure_future(_move(plant))
        try:
            yield plant
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)


async def _move(plant: LiveSource) -> None:
    """Write the set point again and again, in plant time that runs with the clock."""
    clock = asyncio.get_running_loop().time
    began = clock()
    while True:
        await plant.write(VALVE, "setpoint", float(setpoint(SPEED * (clock() - began))))
        await asyncio.sleep(0.05)


async def passed(address: str, samples: int) -> None:
    """Wait until so many samples, ten a second, were read from the served valve by a connection of its own."""
    async with open_source(address, valves_of(RegisterMap.load("damadics")), Polling(10.0)) as source:
        async with asyncio.timeout(PATIENCE):
            async for item in source:
                samples -= isinstance(item, Sample)
                if samples <= 0:
                    return


class MonitorProcess:
    """`bristle monitor` in its process, with its events as they come."""

    def __init__(self, process: Process) -> None:
        self.process = process
        self.events: list[dict] = []

    @classmethod
    async def start(cls, source: str, model: Path, *more: str) -> MonitorProcess:
        """Start it; events come on its standard output."""
        options = ("--source", source, "--map", "damadics", "--model", str(model), "--rate", f"{RATE:g}")
        command = (sys.executable, "-m", "bristle", "monitor", *options, *more)
        return cls(await asyncio.create_subprocess_exec(*command, stdout=PIPE, stderr=PIPE))

    async def event(self, *kinds: str, fault: str | None = None, patience: float = PATIENCE) -> dict:
        """The next event of one of these kinds (and of this fault, where one is named)."""
        async with asyncio.timeout(patience):
            while True:
                line = await self.process.stdout.readline()
                if not line:
                    raise AssertionError(f"the monitor ended: {(await self.process.stderr.read()).decode()}")
                self.events.append(json.loads(line))
                if self.events[-1]["kind"] in kinds and fault in (None, self.events[-1]["fault"]):
                    return self.events[-1]

    async def said(self, words: str) -> str:
        """The line of its standard error in which these words come."""
        async with asyncio.timeout(PATIENCE):
            while line := (await self.process.stderr.readline()).decode():
                if words in line:
                    return line
        raise AssertionError(f"the monitor ended without saying {words!r}")

    async def end(self, number: int) -> int:
        """Send it a signal, read what is left, and return its exit code."""
        self.process.send_signal(number)
        out, _ = await asyncio.wait_for(self.process.communicate(), PATIENCE)
        self.events += [json.loads(line) for line in out.splitlines()]
        return self.process.returncode
