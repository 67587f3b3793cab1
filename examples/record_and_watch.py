"""Record a valve over Modbus, learn its healthy behaviour, and find a fault in a later recording.

    python examples/record_and_watch.py [FOLDER]

The valve is simulated, and served behind Modbus in the background of this program, on loopback. The process moves it
to and fro. Later its position sensor has a fault.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import bristle as br
from recordings import Array
from simulator.damadics.stimuli import constant

SPEED = 10.0
"""Times real time of the served valve."""

SECONDS = 15.0
"""How long each recording takes, by the clock [s]."""

SENSOR = 13
"""Number of the fault in the benchmark: the sensor of the rod's position reads wrong."""

FAULT_S = 80.0
"""When the fault begins, by the clock of the plant [s]."""


def moving(t: Array) -> Array:
    """The process: steady, but that the valve opens and closes every ten seconds of plant time."""
    columns = constant(0.5)(t)
    columns[:, 0] += 0.3 * np.sin(2 * np.pi * t / 10.0) + 0.05 * np.sin(t)
    return columns


def recorded(path: Path, *faults: br.Fault) -> br.Recording:
    """Serve the valve, record it for a while, and read the recording."""
    path.unlink(missing_ok=True)
    with br.serve(stimulus=moving, speed=SPEED, noise=True, faults=faults) as served:
        time.sleep(1.0)  # until the valve moves as it will
        with br.record(served.address, path, map="damadics", rate=20.0, duration=SECONDS) as recorder:
            recorder.wait(2 * SECONDS)
    print(f"{path.name}: {recorder.report.samples} samples")
    return br.read(path)


def main(folder: Path) -> None:
    """Record twice, learn from the first recording, and watch both."""
    healthy = recorded(folder / "healthy.h5")
    broken = recorded(folder / "broken.h5", br.Fault(SENSOR, 1.0, FAULT_S))

    found = br.learn(healthy, false_alarms=1000.0)  # as few a month as so short a recording supports
    print("healthy:", br.watch(healthy, found))
    seen = br.watch(broken, found)
    print("broken: ", seen)
    for one in seen.changes:
        print(f"  {one.time_s:6.2f} s  {'alarm' if one.began else 'change'}  {one.kind or 'of unknown kind'}")
    seen.report(folder / "watched.html")
    print(f"wrote watched.html to {folder}; the fault began {FAULT_S / SPEED:.0f} s after the start")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
