"""How fast the DAMADICS actuator runs, alone, in a fleet, and step by step.

    python -m benchmarks.simulator               everything (about five minutes)
    python -m benchmarks.simulator --hours 1     the long scenario cut to an hour

Times real time: simulated seconds over seconds of the clock; in brackets over seconds of this process' own
processor time, which says what one core could do where the machine is shared.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from benchmarks.machine import machine
from simulator.damadics import FORMS, INPUTS, Actuator, Form, run_scenario, stimuli

SEED = 1
TARGET = {"play": 2000, "lugre": 1000}
"""Times real time that one core has to reach."""


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Clock and processor time of some work [s]."""
    clock, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - clock, time.process_time() - processor


def speed(form: Form, noise: bool) -> None:
    """An hour of Step I at 1 Hz, three times."""
    run_scenario("healthy", form, duration=10.0)
    ratios = []
    for _ in range(3):
        clock, processor = timed(lambda: run_scenario("healthy", form, noise, SEED, duration=3600.0))
        ratios.append(f"{3600 / clock:6.0f} ({3600 / processor:6.0f})")
    print(f"{form:6} 1 h, noise {'on ' if noise else 'off'}   x real time {'  '.join(ratios)}   target {TARGET[form]}")


def day(form: Form, hours: float) -> None:
    """The slow incipient scenario, in a process of its own: time and peak memory."""
    code = (
        "import sys, time, resource; from simulator.damadics import run_scenario; "
        "run_scenario('healthy', sys.argv[1], duration=10.0); "
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss; t, c = time.perf_counter(), time.process_time(); "
        "run_scenario('f9-incipient', sys.argv[1], True, 1, duration=float(sys.argv[2])); "
        "after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss; "
        "print(f'{time.perf_counter() - t:.1f} s ({time.process_time() - c:.1f} s of processor), ' "
        "f'peak memory {after / 1024:.0f} MB, {(after - before) / 1024:.0f} MB of it for the run')"
    )
    seconds = min(85500.0, hours * 3600.0)
    done = subprocess.run([sys.executable, "-c", code, form, str(seconds)], capture_output=True, text=True, check=True)
    print(f"{form:6} f9-incipient with noise, {seconds / 3600:.2f} h at 1 Hz: {done.stdout.strip()}")


def fleet(form: Form, valves: int, seconds: float) -> None:
    """Many actuators with their own noise, in as many threads as there are cores: the compiled loops run at once."""
    workers = os.cpu_count() or 1

    def one(seed: int) -> None:
        run_scenario("healthy", form, True, seed, duration=seconds)

    def all_of_them() -> None:
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(one, range(valves)))

    clock, _ = timed(all_of_them)
    total = valves * seconds / clock
    print(f"{form:6} fleet of {valves}, {workers} threads, {seconds:g} s each: {total:.0f} valve-seconds a second")
    print(f"{'':6} so {valves} valves run {total / valves:.1f} x real time together")


def calls(form: Form) -> None:
    """Time of one `advance` by few steps, as a server in lock-step makes them."""
    valve, times = Actuator(form), []
    for n in (1, 10, 40, 400):
        rows = np.zeros((n, len(INPUTS)))
        rows[:, :5] = stimuli.constant(0.5)(np.arange(n) * 0.0025)
        state, count = valve.advance(valve.start(), rows)[0], 500
        start = time.perf_counter()
        for _ in range(count):
            state, _ = valve.advance(state, rows)
        times.append(f"{n} steps {(time.perf_counter() - start) / count * 1e6:.0f} us")
    print(f"{form:6} one call of advance: {', '.join(times)}")


def build(form: Form) -> None:
    """Time to a first state in a fresh process, with an empty and with a filled cache."""
    code = (
        "import sys, time; from simulator.damadics import Actuator; t = time.perf_counter(); "
        "Actuator(sys.argv[1]).start(); print(f'{time.perf_counter() - t:.2f} s')"
    )
    with tempfile.TemporaryDirectory() as cache:
        found = [
            subprocess.run(
                [sys.executable, "-c", code, form], capture_output=True, text=True, check=True,
                env={**os.environ, "BRISTLE_CACHE": cache},
            ).stdout.strip()
            for _ in range(2)
        ]  # fmt: skip
    print(f"{form:6} build: {found[0]} with an empty cache, {found[1]} with a filled one")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0, help="length of the long scenario")
    parser.add_argument("--valves", type=int, default=100, help="size of the fleet")
    options = parser.parse_args()
    print(machine("numpy", "casadi", "scipy"))
    print(f"seed {SEED}, load average {', '.join(f'{load:.1f}' for load in os.getloadavg())}")
    for form in FORMS:
        build(form)
        speed(form, noise=False)
        speed(form, noise=True)
        calls(form)
        fleet(form, options.valves, 300.0)
        day(form, options.hours)
    print(f"peak memory of this process {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
