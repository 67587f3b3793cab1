"""How often, how fast and in how much memory `fit` identifies a valve, and the same work by the usual means.

    python -m benchmarks.fit                 everything (about half an hour)
    python -m benchmarks.fit --valves 10 --budget 30     a quick one

Random valves: see `simulator.random_valve`; truth with a sub-step of 0.05 ms, exact force,
position noise 1e-4 of the stroke.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

from benchmarks.baselines import BASELINES
from benchmarks.machine import machine
from identification import Experiment, Fit, Outcome, experiment, fit
from recordings import Recording
from simulator import BASE, Excitation, Sensors, kernel, random_valve, simulate

NOISE = 1e-4


def valve_recording(seed: int, seconds: float, rate: float) -> tuple[Recording, dict[str, float], float]:
    """A recording of a random valve, its true parameters, and the root mean square of its position noise [m]."""
    values, stroke = random_valve(seed)
    recording, truth = simulate(
        values, Excitation.parse(f"mixed:{seconds}"), Sensors(rate, NOISE * stroke), stroke=stroke, seed=seed
    )
    noise = recording["position"].values - np.asarray(truth["position"])
    return recording, values, float(np.sqrt(np.mean(noise**2)))


def timed_fit(recording: Recording) -> tuple[Fit, Experiment, float]:
    """A fit without starting values, and its time [s]."""
    prepared = experiment(recording)
    start = time.perf_counter()
    found = fit([prepared])
    return found, prepared, time.perf_counter() - start


def build_time() -> None:
    """Time to build the kernels in a fresh process, with an empty and with a filled cache."""
    code = (
        "import time; t = time.perf_counter(); from simulator import BASE, kernel; i = time.perf_counter(); "
        "kernel(BASE); kernel(BASE, 'motion'); print(f'{i - t:.2f} s import, {time.perf_counter() - i:.2f} s kernels')"
    )
    with tempfile.TemporaryDirectory() as cache:
        for label in ("empty cache", "filled cache"):
            environment = {**os.environ, "BRISTLE_CACHE": cache}
            done = subprocess.run(
                [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True
            )
            print(f"  {label}: {done.stdout.strip()}")


def random_valves(count: int) -> None:
    """How many of `count` seeded valves end within 5 % of the noise floor, and the times."""
    times, good, evaluations = [], 0, []
    for seed in range(count):
        recording, _, noise = valve_recording(seed, 40, 500)
        found, prepared, seconds = timed_fit(recording)
        times.append(seconds)
        reached = (found.rms * prepared.noise_position / noise) ** 2 if found.minimum else np.inf
        evaluations.append(found.minimum.evaluations if found.minimum else 0)
        if reached <= 1.05:
            good += 1
        else:
            honest = "says so" if found.outcome is not Outcome.CONVERGED or found.rms > 2 else "does not say so"
            print(f"  seed {seed}: cost {reached:.4g} times the floor, outcome {found.outcome.name} ({honest})")
    print(f"  {good} of {count} within 5 % of the noise floor; time a fit: median {np.median(times):.2f} s, "
          f"90 % {np.quantile(times, 0.9):.2f} s, longest {max(times):.2f} s; "
          f"median {np.median(evaluations):.0f} Jacobians")  # fmt: skip


def growth() -> None:
    """Time against the number of samples, and the peak memory of a fresh process."""
    for seconds, rate in ((20, 100), (40, 500), (200, 1000)):
        code = (
            f"from benchmarks.fit import timed_fit, valve_recording; r, _, n = valve_recording(1, {seconds}, {rate}); "
            "timed_fit(r); f, e, t = timed_fit(r); import resource; "
            "print(f'{len(r)} samples: {t:.2f} s, cost {(f.rms * e.noise_position / n) ** 2:.3f} times the floor, '"
            "f'peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB')"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        print("  " + done.stdout.strip())


def against_baselines(budget: float) -> None:
    """The same work by scipy and lmfit, started 1 % from the truth; ours starts from nothing."""
    recording, values, noise = valve_recording(1, 20, 100)
    found, prepared, ours = timed_fit(recording)
    reached = (found.rms * prepared.noise_position / noise) ** 2
    print(f"  {len(recording)} samples; ours, no starting values: {ours:.2f} s, cost {reached:.3f} times the floor")
    p = kernel(BASE).vector(values) * (1 + 0.01 * np.random.default_rng(0).choice([-1.0, 1.0], len(values)))
    for name, run in BASELINES.items():
        seconds, cost, why = run(recording, p, noise, 1.001 * reached, budget)
        print(
            f"  {name}, started 1 % off: {seconds:.1f} s, cost {cost:.4g} times the floor, {why}; "
            f"ratio {seconds / ours:.0f}"
        )


def main() -> None:
    """Print all tables."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--valves", type=int, default=100, help="number of random valves")
    options.add_argument("--budget", type=float, default=300, help="seconds given to each baseline")
    asked = options.parse_args()
    print(machine("casadi", "numpy", "scipy", "lmfit"))
    print("kernel build, apart from all fits")
    build_time()
    kernel(BASE), kernel(BASE, "motion")
    print(f"{asked.valves} random valves, 20,001 samples, seeds 0 to {asked.valves - 1}")
    random_valves(asked.valves)
    print("growth with the number of samples (one valve, seed 1)")
    growth()
    print("the same work by other means (one valve, seed 1)")
    against_baselines(asked.budget)
    print(f"peak memory of this process {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
