"""The service for long: chaos for ten minutes, a day of twenty valves, and ten minutes at 100 Hz after five to
warm up. Run with -m long."""

from __future__ import annotations

import asyncio
import ctypes
import gc
import json
import os
import re
import sys
import tempfile
from typing import ClassVar

import numpy as np
import pytest
from monitor_rig import model_file
from service_rig import plan_of, running
from test_service_run import assert_every_value_true, chaos, nothing_unhandled, recorded, usage

from benchmarks.monitor import Rig, plan_for, rig, watch_at
from hil import Service, ServiceOutlets
from recordings import Plant, Recording, Signal, read, write

pytestmark = pytest.mark.long

GROWTH_MB_PER_H = 1.0
DAY_S, VALVES = 86400.0, 20
WARM_S, SOAK_S, RATE = 300.0, 600.0, 100.0


def slope_per_hour(times_s: list[float], sizes: list[float], warm_s: float) -> float:
    """Growth [a unit an hour], by a line through what came after warming up."""
    first = next(k for k, at in enumerate(times_s) if at >= warm_s)
    return 3600.0 * float(np.polyfit(times_s[first:], sizes[first:], 1)[0])


def test_ten_minutes_of_chaos(tmp_path):
    with nothing_unhandled():
        sizes, _ = asyncio.run(chaos(tmp_path, 600.0, seed=5))
    assert sizes[-1] - sizes[4] < 3.0, "memory [MB] over the last five minutes"
    assert sum(assert_every_value_true(recorded(tmp_path / "rec", tag)) for tag in ("V1", "V2")) > 1000


class _MallInfo(ctypes.Structure):
    """What glibc's malloc says of itself; see mallinfo(3)."""

    _fields_: ClassVar = [
        (name, ctypes.c_size_t)
        for name in (
            "arena",
            "ordblks",
            "smblks",
            "hblks",
            "hblkhd",
            "usmblks",
            "fsmblks",
            "uordblks",
            "fordblks",
            "keep",
        )
    ]


def live_mb() -> tuple[float, float]:
    """Memory in use [MB], of Python's allocator and of malloc. The resident size moves in steps of 0.1 MB or more: in
    ten minutes it cannot tell 1 MB an hour.
    """
    gc.collect()
    with tempfile.TemporaryFile() as said:
        kept = os.dup(2)
        os.dup2(said.fileno(), 2)
        try:
            sys._debugmallocstats()
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        said.seek(0)
        words = said.read().decode(errors="replace")
    ours = int(re.search(r"# bytes in allocated blocks\s+=\s+([\d,]+)", words)[1].replace(",", ""))
    library = ctypes.CDLL(None)
    library.mallinfo2.restype = _MallInfo
    found = library.mallinfo2()
    return ours / 1e6, (found.uordblks + found.hblkhd) / 1e6


def test_ten_minutes_at_100_hz_do_not_grow(tmp_path):
    """One valve that is judged, recorded and measured; what it was learned from is another's growth."""

    async def story(rig: Rig) -> tuple[list[tuple[float, float, float, float, int]], Service]:
        rows = []
        plan = plan_for(rig, 1, RATE, True, watch_at(rig, RATE))
        async with running(plan, ServiceOutlets([], ("127.0.0.1", 0))) as service:
            loop = asyncio.get_running_loop()
            began = loop.time()
            while loop.time() - began < WARM_S + SOAK_S:
                await asyncio.sleep(5.0)
                rows.append((loop.time() - began, *live_mb(), *usage()))
        return rows, service

    with rig() as shared:
        rows, service = asyncio.run(story(shared))
        n = sum(len(read(path).time) for path in shared.folder.glob("rec-*/V0-*.h5"))
    found = service.status().valves[0]
    times, python, malloc, resident, open_ = (list(column) for column in zip(*rows, strict=True))
    live = [a + b for a, b in zip(python, malloc, strict=True)]
    print(f"{n} samples, {found.link.late} late; {slope_per_hour(times, live, WARM_S):.3f} MB/h in use")
    shown = [(int(t), round(a, 3), round(b, 3), round(c, 2)) for t, a, b, c, _ in rows[::6]]
    print("at [s], in use by Python, by malloc [MB], resident [MB]:", shown)
    assert (found.link.lost, n) == (0, found.link.samples)
    assert found.phase != "learning"
    warm = next(k for k, at in enumerate(times) if at >= WARM_S)
    assert max(open_[warm:]) <= open_[warm] + 1
    assert slope_per_hour(times, live, WARM_S) < GROWTH_MB_PER_H
    assert max(resident[warm:]) - resident[warm] < 3.0, "steps of the allocator, no slope"


def day_of(seed: int) -> Recording:
    """A day of a valve at 1 Hz that follows its set point, with noise."""
    random, t = np.random.default_rng(seed), np.arange(0.0, DAY_S, 1.0)
    asked = 0.5 + 0.2 * np.sin(t / 150.0) + 0.1 * np.sin(t / 1900.0)
    x = 0.0381 * asked + random.normal(0.0, 1e-5, len(t))
    signals = [
        Signal("time", t, "s", "time"), Signal("setpoint", asked, "1", "input"), Signal("position", x, "m", "output"),
    ]  # fmt: skip
    return Recording.of(signals, plant=Plant(stroke_m=0.0381))


def test_a_day_of_twenty_valves_does_not_grow(tmp_path):
    model_file(tmp_path)
    lines = ['name = "Day"', "figures_every_s = 20.0"]
    for k in range(VALVES):
        write(tmp_path / f"day{k}.h5", day_of(100 + k))
        lines += ["[[source]]", f'address = "replay:day{k}.h5"', "[[source.valve]]", f'tag = "D{k}"']
        lines += ['model = "model.json"', "learn_s = 7200.0"]
    (tmp_path / "plant.toml").write_text("\n".join(lines) + '\n[recordings]\nfolder = "rec"\n')
    plan = plan_of(tmp_path / "plant.toml")

    async def story() -> tuple[list[float], list[float], Service]:
        service, done, sizes = Service(plan, ServiceOutlets([])), [], []
        task = asyncio.create_task(service.run(asyncio.Event()))
        while not task.done():
            await asyncio.sleep(2.0)
            done.append(sum(one.link.samples for one in service.status().valves) / VALVES)  # seconds of the day
            sizes.append(usage()[0])
        await task
        return done, sizes, service

    done, sizes, service = asyncio.run(story())
    grown = slope_per_hour(done, sizes, DAY_S / 2)
    print(f"{grown:.3f} MB an hour of plant time")
    assert grown < GROWTH_MB_PER_H
    for one in service.status().valves:
        assert (one.link.samples, one.link.lost) == (int(DAY_S), 0)
        assert one.phase == "watching", one.evidence
        assert one.figures is not None
        assert one.figures.at.timestamp() <= DAY_S, "a recording has its own time"
        kept = json.loads((tmp_path / "state" / f"{one.tag}.service.json").read_text())
        assert kept["movements"]["observed_s"] == pytest.approx(DAY_S, rel=1e-3)
