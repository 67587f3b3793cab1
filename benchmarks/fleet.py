"""A fleet on the processes of this machine against a plain serial loop, what a task costs besides its work, and memory.

    python -m benchmarks.fleet [--recordings 200] [--samples 20000] [--workers 2] [--every 5]

The work is `fit`. A plain loop does every fifth recording and is taken times five, for one fit knows nothing of
another; `--every 1` does them all. It is timed twice: as one would type it, where a fit uses the cores as far as it
can, and with one thread, as a worker has. Where other programs share the machine the clock says little; the processor
time of the fleet, start and scheduling included, over that of the loop says what the fleet costs, and the load is
printed. The projection to a plant of 10,000 valves on 100 cores takes from the measurement the time of a task in a
worker, the overhead of a task, and the start of a cluster; it is arithmetic, not a measurement.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import bristle as br
from benchmarks.machine import machine
from bristle.fleet import opened, run_fleet
from identification import one_thread
from recordings import Recording, bundled, write

VALVES, CORES = 10_000, 100
EMPTY_TASKS = 500
NOISE_M = 2e-6


def plant(folder: Path, n_recordings: int, n_samples: int) -> None:
    """Recordings of `n_samples` each: those of a bundled valve again and again, each with noise of its own."""
    mixed = bundled("mixed")
    step = float(mixed.time[1] - mixed.time[0])
    for k in range(n_recordings):
        made = _repeated(mixed, n_samples)
        position = made["position"] + np.random.default_rng(k).normal(0.0, NOISE_M, n_samples)
        recording = Recording.from_arrays(
            time=step * np.arange(n_samples), position=position, force=made["force"], plant=mixed.plant
        )
        write(folder / f"V{k:04d}.h5", recording)


def _repeated(recording: Recording, n_samples: int) -> dict[str, Any]:
    """The signals played forwards and backwards until there are enough samples: no jump anywhere."""
    found = {}
    for name in ("position", "force"):
        values = recording[name].values
        there_and_back = np.concatenate([values, values[::-1]])
        found[name] = np.resize(there_and_back, n_samples)
    return found


class Stopwatch:
    """Clock and processor time [s] of this process and of its children that have ended."""

    def __init__(self) -> None:
        self.clock, self.processor = time.perf_counter(), self._processor()

    @staticmethod
    def _processor() -> float:
        own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime

    def read(self) -> tuple[float, float]:
        """What has passed on both."""
        return time.perf_counter() - self.clock, self._processor() - self.processor


def serial(folder: Path, every: int) -> tuple[float, float]:
    """Seconds, by the clock and of the processor, of a plain loop over all recordings, as every so many of them say."""
    paths = sorted(folder.iterdir())
    watch, done = Stopwatch(), paths[::every]
    for path in done:
        br.fit(path, crosscheck=False)
    clock, processor = watch.read()
    return clock * len(paths) / len(done), processor * len(paths) / len(done)


def on_workers(folder: Path, out: Path, workers: int) -> tuple[tuple[float, float], list[Any]]:
    """The same and the rows with processes, their start included."""
    watch = Stopwatch()
    rows = run_fleet("fit", str(folder), out, workers=workers)
    return watch.read(), rows


def overhead_s(workers: int) -> tuple[float, float]:
    """Seconds to start a cluster, and seconds of a task that does nothing."""
    started = time.perf_counter()
    with opened(None, workers) as client:
        client.submit(int, 0, pure=False).result()
        ready = time.perf_counter()
        client.gather([client.submit(int, k, pure=False) for k in range(EMPTY_TASKS)])
        return ready - started, (time.perf_counter() - ready) / EMPTY_TASKS


def projected_s(task_s: float, overhead: float, start_s: float) -> tuple[float, float]:
    """Seconds for the plant, and the share of them that is not work. start_s : of a cluster."""
    work = VALVES * task_s / CORES
    scheduling = VALVES * overhead  # the scheduler is one process: this part does not shrink with cores
    total = start_s + max(work, scheduling) + task_s
    return total, 1.0 - work / total


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--samples", type=int, default=20_000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--every", type=int, default=5, help="the serial loop does every so many recordings")
    chosen = parser.parse_args(arguments)
    print(machine("distributed", "numpy"), f"load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "plant"
        folder.mkdir()
        plant(folder, chosen.recordings, chosen.samples)
        br.fit(next(folder.iterdir()), crosscheck=False)  # compiles what all need
        plain_s, _ = serial(folder, chosen.every)
        with one_thread():
            alone_s, alone_processor_s = serial(folder, chosen.every)
        (together_s, processor_s), together = on_workers(folder, Path(name) / "fleet.parquet", chosen.workers)
    start_s, overhead = overhead_s(chosen.workers)
    task_s = statistics.median(row["seconds"] for row in together)
    memory = max(row["worker_memory_MB"] for row in together)
    states = sorted({row["state"] for row in together})
    print(f"{chosen.recordings} recordings of {chosen.samples} samples, {chosen.workers} workers; states {states}")
    print(f"fleet {together_s:.1f} s with the start; loops of one recording in {chosen.every}, taken as all:")
    for how, seconds in (("as typed", plain_s), ("with one thread", alone_s)):
        print(f"plain loop, {how}: {seconds:.1f} s, which is {seconds / together_s:.2f} times as long")
    print(
        f"processor: loop with one thread {alone_processor_s:.1f} s, fleet {processor_s:.1f} s; with nobody else on "
        f"{chosen.workers} cores that is {chosen.workers * alone_processor_s / processor_s:.2f} times"
    )
    print(f"a task: {task_s:.3f} s of work (median), {1e3 * overhead:.2f} ms overhead; start {start_s:.1f} s")
    print(f"memory of a worker: {memory:.0f} MB at most")
    total, lost = projected_s(task_s, overhead, start_s)
    print(f"projected, {VALVES} valves on {CORES} cores: {total / 60:.1f} min, {100 * lost:.1f} % of it not work")


if __name__ == "__main__":
    main()
