"""What one pass of the noise-aware estimator costs: in parts, as without a C compiler, and as one compiled pass.

    python -m benchmarks.pass

A simulated recording with noise in both channels, sampled every 2 ms; sub-steps of the shots as stated. The least of
many times, in microseconds of processor time for every node; the normal equations are in them, the way back is not.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from benchmarks.machine import machine
from identification import experiment
from identification.estimators import (
    Coordinates,
    Innovations,
    KalmanSmoother,
    NoiseAware,
    PathFreedom,
    grids,
    linearise_in_parts,
    totals,
)
from recordings import Array
from simulator import BASE, Excitation, Sensors, kernel, random_valve, simulate

STEP = 2e-3
"""Time between samples [s]."""
CHOICES = ((BASE, False), (BASE, True), ((*BASE, "backlash", "asymmetric_coulomb"), False))
"""Effects, and whether by the damped step."""


def estimator(effects: tuple[str, ...], damped: bool, seconds: float) -> tuple[NoiseAware, Array]:
    """The estimator of some effects on a recording of the base effects, and coordinates near the truth."""
    values, stroke = random_valve(7)
    sensors = Sensors(1 / STEP, position_noise=2e-4 * stroke, force_noise=1e-3 * values["spring.K"] * stroke)
    recording, _ = simulate(values, Excitation.parse(f"mixed:{seconds}"), sensors, stroke=stroke, seed=1)
    segment_grids = grids([experiment(recording)])
    model = kernel(effects, "force with error", damped=damped)
    free = Coordinates.of(model, {}, float(np.std(segment_grids[0].u)))
    added = {"backlash.width": 1e-4 * stroke, "asymmetric_coulomb.a": 0.05}
    return NoiseAware(model, free, segment_grids), free.theta_of(values | added)


def passes(by: NoiseAware, theta: Array, steps: int) -> dict[str, Callable[[], Innovations | None]]:
    """Both ways of a pass along the path at some coordinates."""
    [grid], p, freedom = by.grids, by.coordinates.p(theta), PathFreedom(h_max=STEP / steps)
    start = by.start(theta)
    if start is None:
        raise RuntimeError("the model has no solution at the coordinates of the benchmark")
    arguments = by.kernel, by.coordinates, grid, p, start.paths[0], freedom

    def in_parts() -> Innovations | None:
        line = linearise_in_parts(*arguments)
        totals(line) if line else None
        return line

    return {"in parts": in_parts, "compiled": lambda: KalmanSmoother().line(*arguments)}


def least(ways: dict[str, Callable[[], Innovations | None]], rounds: int) -> dict[str, float]:
    """The least time [s] of each way, taken in turns: the machine may be shared."""
    times = dict.fromkeys(ways, np.inf)
    for _ in range(rounds):
        for name, work in ways.items():
            start = time.process_time()
            work()
            times[name] = min(times[name], time.process_time() - start)
    return times


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seconds", type=float, default=40.0, help="length of the recording")
    options.add_argument("--rounds", type=int, default=20)
    asked = options.parse_args()
    print(machine("casadi", "numba", "numpy"))
    for effects, damped in CHOICES:
        by, theta = estimator(effects, damped, asked.seconds)
        nodes = len(by.grids[0].t)
        more = ", ".join(effects[len(BASE) :])
        print(f"base effects{f', {more}' if more else ''}{', damped step' if damped else ''}: {len(theta)} parameters, "
              f"{len(by.kernel.states)} states, {nodes} nodes")  # fmt: skip
        for steps in (1, 4, 8):
            times = least(passes(by, theta, steps), asked.rounds)
            cells = "   ".join(f"{name} {1e6 * seconds / nodes:5.2f} us" for name, seconds in times.items())
            print(f"  {steps} sub-steps   {cells}   ratio {times['in parts'] / times['compiled']:.1f}")


if __name__ == "__main__":
    main()
