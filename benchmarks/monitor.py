"""What one process of the service holds: valves at 10 and 100 Hz, and what detection, recording and metrics cost.

    python -m benchmarks.monitor                              everything (some ten minutes)
    python -m benchmarks.monitor --seconds 5 --most 8         a look

The devices are another process that answers from memory, sixteen behind one address as on a gateway. Valves are added,
doubling, for as long as fewer than 1 % of the deadlines are missed. The cost is processor time of this process for one
valve, in ms a second. The first table compares acquisition alone with detection, recording and metrics (asked for every
15 s) on top, for the same valves, and then a page that a browser has open (Chromium, where it is installed). Processor
time of the process of the page counts as well; that of browser and devices does not.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.machine import machine
from benchmarks.monitor_device import MAP, Devices
from detector import Watch, learn_recordings
from hil import Monitor, Page, PageSettings, PlantFile, Service, ServiceOutlets, ServicePlan, ServiceTask, save_state
from recordings import Plant, Recording, Signal
from simulator import Value, ValveModel
from simulator.damadics import Actuator, Noise, Parameters, Scenario, run, stimuli

GOAL_MISSED, GOAL_COST = 0.01, 0.30
BEHIND_ONE = 16
SETTLED_S, DRAWN_S = 4.0, 10.0
SCRAPED_S = 15.0
"""Prometheus is set to ask so often in most plants [s]."""
MODEL = {
    "mass.m": (2.0, "kg"), "spring.K": (1.17e5, "N/m"), "spring.F0": (1950.0, "N"), "lugre.fc": (130.0, "N"),
    "lugre.fs": (170.0, "N"), "lugre.vs": (1e-3, "m/s"), "lugre.sigma0": (3e6, "N/m"),
    "lugre.sigma1": (3.5e3, "N s/m"), "lugre.sigma2": (1500.0, "N s/m"),
}  # fmt: skip


@dataclass(frozen=True)
class Rig:
    """Everything that the runs share."""

    folder: Path
    model: ValveModel
    recording: Recording
    port: int


class Load(NamedTuple):
    """missed : share of the deadlines; cost : processor time a valve [ms/s]; lost : samples that were dropped."""

    missed: float
    cost: float
    lost: int


def healthy() -> Recording:
    """Four minutes of a valve in good order at 10 Hz."""

    def stimulus(t: np.ndarray) -> np.ndarray:
        columns = stimuli.constant(0.5)(t)
        columns[:, 0] = 0.5 + 0.12 * np.sin(2 * np.pi * t / 14.0) + 0.08 * np.sin(2 * np.pi * t / 47.0)
        return columns

    scenario = Scenario("moved", "to and fro", stimulus, 250.0, (), 0.1)
    made = run(scenario, Actuator("lugre", Parameters(), {}), Noise(3), duration=250.0, sample=0.1)[0]
    kept = [made.si("time"), *(made.si(name) for name in ("setpoint", "position", "pressure"))]
    cut = [Signal(one.name, one.values[100:], one.unit, one.role) for one in kept]
    return Recording.of(cut, plant=Plant(stroke_m=0.0381, diaphragm_area_m2=0.029))


@contextmanager
def rig() -> Iterator[Rig]:
    """A folder with model and map, and the devices."""
    with tempfile.TemporaryDirectory() as name:
        folder, recording = Path(name), healthy()
        values = {key: Value(value=value, unit=unit) for key, (value, unit) in MODEL.items()}
        plant: dict[str, float | str] = {"diaphragm_area_m2": 0.029, "stroke_m": 0.0381}
        model = ValveModel(effects=("inertia", "spring", "lugre"), parameters=values, plant=plant)
        model.write(folder / "model.json")
        (folder / "map.toml").write_text(MAP)
        np.save(
            folder / "table.npy", np.column_stack([recording[n].values for n in ("position", "setpoint", "pressure")])
        )
        devices = Devices(folder / "table.npy")
        try:
            yield Rig(folder, model, recording, devices.port)
        finally:
            devices.kill()


def watch_at(rig: Rig, rate: float) -> Watch:
    """The detector, learned at a rate: the valve is as many times faster as the rate is above 10 Hz."""
    slower = rate / 10.0
    signals = [
        Signal(one.name, one.values / (slower if one.role == "time" else 1.0), one.unit, one.role)
        for one in rig.recording.signals.values()
    ]
    return learn_recordings([Recording.of(signals, plant=rig.recording.plant)], rig.model)


def plan_for(rig: Rig, valves: int, rate: float, recorded: bool, watch: Watch | None) -> ServicePlan:
    """A plant file for so many valves; with a detector their states are there already, else they learn for ever."""
    lines = ['name = "bench"', f'state = "state-{valves}-{rate:g}-{watch is not None}"']
    for k in range(valves):
        if k % BEHIND_ONE == 0:
            lines += ["[[source]]", f'address = "tcp://127.0.0.1:{rig.port}"', f"rate_hz = {rate}"]
        lines += ["[[source.valve]]", f'tag = "V{k}"', 'map = "map.toml"', f"unit = {1 + k}", 'model = "model.json"']
        lines.append("learn_s = 1e7")
    lines += ["[recordings]", f'folder = "rec-{valves}-{rate:g}-{time.monotonic_ns()}"'] if recorded else []
    path = rig.folder / "plant.toml"
    path.write_text("\n".join(lines) + "\n")
    plan = ServicePlan.of(PlantFile.read(path))
    if watch is not None:
        state = rig.folder / plan.plant.state
        state.mkdir(exist_ok=True)
        for valve in plan.valves:
            monitor = Monitor.with_model({valve.tag: valve.signals}, rig.model)
            monitor.resume({valve.tag: (watch, None)})
            save_state(state / f"{valve.tag}.state.json", list(monitor.valves.values()), valve.model_key)
    return plan


def fetched(url: str) -> bytes:
    """What is behind an address."""
    with urllib.request.urlopen(url, timeout=60) as answer:
        found: bytes = answer.read()
    return found


@contextmanager
def looked_at(url: str) -> Iterator[None]:
    """Somebody has the page of a valve open."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        yield
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = ("--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0")
        command = [browser, *options, f"--user-data-dir={profile}", f"{url}valve?tag=V0"]
        started = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            yield
        finally:
            started.terminate()
            started.wait()


def spent_by(process: int | None) -> float:
    """Processor time of another process so far [s]; 0 for none."""
    if process is None:
        return 0.0
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


async def loaded(plan: ServicePlan, seconds: float, metrics: bool, paged: bool = False) -> Load:
    """Run the service, some seconds to settle, and count. paged : with a page that somebody looks at."""
    service, stop = Service(plan, ServiceOutlets([], ("127.0.0.1", 0) if metrics else None)), asyncio.Event()
    with ExitStack() as opened:
        page = opened.enter_context(Page(PageSettings(), service)) if paged else None
        more: Mapping[str, ServiceTask] = {} if page is None else {"page": page.run}
        task = asyncio.create_task(service.run(stop, more))
        await asyncio.sleep(SETTLED_S)
        if page is not None:
            await asyncio.to_thread(fetched, f"{page.url}alive")
            opened.enter_context(looked_at(page.url))
            await asyncio.sleep(DRAWN_S)
        shown = None if page is None else page.process
        cost, began, before = time.process_time() + spent_by(shown), time.perf_counter(), service.status()
        while time.perf_counter() - began < seconds:
            if metrics and service.metrics is not None:
                await asyncio.to_thread(fetched, f"http://127.0.0.1:{service.metrics.port}/metrics")
            await asyncio.sleep(min(SCRAPED_S, seconds))
        spent = time.process_time() + spent_by(shown) - cost
        lasted, after = time.perf_counter() - began, service.status()
        stop.set()
        await task
    firsts = range(0, len(after.valves), BEHIND_ONE)
    late = sum(after.valves[k].link.late - before.valves[k].link.late for k in firsts)
    due = sum(source.rate_hz * lasted for source in plan.sources)
    return Load(late / due, 1e3 * spent / lasted / len(after.valves), sum(one.link.lost for one in after.valves))


def held(rig: Rig, rate: float, watch: Watch, seconds: float, most: int) -> list[str]:
    """How many valves at a rate, doubling."""
    lines, valves = [], 1
    while valves <= most:
        load = asyncio.run(loaded(plan_for(rig, valves, rate, True, watch), seconds, True))
        kept = load.missed < GOAL_MISSED and not load.lost
        missed = f"{100 * load.missed:.2f} % of deadlines missed, {load.lost} samples dropped"
        lines.append(
            f"  {rate:5g} Hz {valves:4} valves: {missed}, {load.cost:.2f} ms/s a valve{'' if kept else '  too many'}"
        )
        print(lines[-1], flush=True)
        if not kept:
            break
        valves *= 2
    return lines


def added(rig: Rig, watch: Watch, seconds: float, valves: int, rate: float) -> str:
    """What detection, recording, metrics and page cost over acquisition alone, one on top of the other."""

    def service(recorded: bool, metrics: bool, paged: bool = False) -> Load:
        return asyncio.run(loaded(plan_for(rig, valves, rate, recorded, watch), seconds, metrics, paged))

    alone = asyncio.run(acquired(plan_for(rig, valves, rate, False, None), seconds)).cost
    steps = [("detection", service(False, False)), ("and recording", service(True, False)),
             ("and metrics", service(True, True)), ("and a page", service(True, True, True))]  # fmt: skip
    words = ", ".join(f"{name} {one.cost:.2f} ({100 * (one.cost / alone - 1):+.0f} %)" for name, one in steps)
    return (
        f"  {valves} valves at {rate:g} Hz, ms/s a valve: acquisition {alone:.2f}; with {words}; goal {GOAL_COST:+.0%}"
    )


async def acquired(plan: ServicePlan, seconds: float) -> Load:
    """The sources alone, read by somebody who throws everything away."""

    async def reading(k: int) -> None:
        async with plan.sources[k].open() as source:
            async for _ in source:
                pass

    tasks = [asyncio.create_task(reading(k)) for k in range(len(plan.sources))]
    await asyncio.sleep(SETTLED_S)
    cost, began = time.process_time(), time.perf_counter()
    await asyncio.sleep(seconds)
    spent, lasted = time.process_time() - cost, time.perf_counter() - began
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    return Load(0.0, 1e3 * spent / lasted / len(plan.valves), 0)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="length of each run [s]")
    parser.add_argument("--most", type=int, default=128, help="valves at most")
    options = parser.parse_args()
    print(machine())
    with rig() as shared:
        watches = {rate: watch_at(shared, rate) for rate in (10.0, 100.0)}
        for valves, rate in ((8, 10.0), (32, 10.0), (2, 100.0)):
            print(added(shared, watches[rate], options.seconds, min(valves, options.most), rate), flush=True)
        for rate, watch in watches.items():
            held(shared, rate, watch, options.seconds, options.most)


if __name__ == "__main__":
    main()
