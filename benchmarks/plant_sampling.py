"""How well `fit` identifies stiff valves at the sampling rates of plants.

    python -m benchmarks.plant_sampling --valves 25 --first 9300 --rates 20 50 100 200
    python -m benchmarks.plant_sampling --valves 8 --first 9300 --rates 50 100 200 --positioner

Random valves of `simulator.random_valve` with bristles of 3e6 to 1e8 N/m; staircase 40 s and sine 90 s, simulated at
1 kHz and kept at the rate; position noise 1e-4 to 4e-4 of the stroke, force noise 0.02 to 0.1 % of the force that the
spring needs over the stroke. With --positioner the valves are those of the examination: in a closed loop, steps and a
sweep of a minute each, on a clock that jitters, in channels of whole steps. Seeds 5000 to 5039, 7000 to 7019, 7100 to
7109, 9100 to 9199, 9500 to 9509, 9700 to 9719, 9900 to 9907, 10200 to 10207, 10302, 10314, 10504, 10506, 10600 to
10609, 10701, 10706, 10900 to 10909, 11000 to 11007, 11100, 11104, 11200 to 11211, 11300 to 11311, 11500 to 11515,
11600 to 11611, 11700 to 11709, 12000 to 12023, 12100 to 12119, 12504, 12511, 12540 to 12609, 12637, 12672, 12703 and
12704 were used to develop the method, and of soft valves 12200 to 12279, 12800 to 12939, 12943, 12960 and 13170 to
13249. All others below 12765 have been looked at, and of soft ones those from 12800 to 13289: they are not for judging
it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from benchmarks.examination import draws
from benchmarks.examination.subjects import TRUTH
from benchmarks.machine import machine
from identification import Experiment, Outcome, experiment, fit, uncertainty_of
from recordings import Array, Recording
from simulator import Excitation, Sensors, random_valve, simulate

FINE = 1000.0
"""Rate at which the truth is simulated [Hz]."""
EXCITATIONS = ("staircase:40", "sine:90")
NORMAL_90 = 1.6449
GROSS = 4.0
"""Standard deviations from which an `identified` parameter is a wrong claim."""


def stiff_valve(seed: int) -> tuple[dict[str, float], float]:
    """A random valve with stiff bristles, and its stroke [m]."""
    values, stroke = random_valve(seed)
    rng = np.random.default_rng([seed, 3])
    stiffness = 10 ** rng.uniform(np.log10(3e6), 8)
    damping = rng.uniform(0.2, 1.0) * np.sqrt(stiffness * values["mass.m"])
    return values | {"lugre.sigma0": float(stiffness), "lugre.sigma1": float(damping)}, stroke


def recordings(seed: int, rate: float) -> tuple[dict[str, float], list[Experiment]]:
    """The true values of a valve, and its recordings at a rate [Hz], ready to fit."""
    values, stroke = stiff_valve(seed)
    rng = np.random.default_rng([seed, 7])
    position = 10 ** rng.uniform(-4, np.log10(4e-4)) * stroke
    force = 10 ** rng.uniform(np.log10(2e-4), -3) * values["spring.K"] * stroke
    found, every = [], round(FINE / rate)
    for i, excitation in enumerate(EXCITATIONS):
        fine, _ = simulate(values, Excitation.parse(excitation), Sensors(FINE), stroke=stroke, seed=10 * seed + i)
        x, u = (fine[name].values + scale * rng.normal(size=len(fine))
                for name, scale in (("position", position), ("force", force)))  # fmt: skip
        found.append(Recording.from_arrays(time=fine["time"].values[::every], position=x[::every], force=u[::every]))
    return values, [experiment(r) for r in found]


def behind_a_positioner(seed: int, rate: float) -> tuple[dict[str, float], list[Experiment]]:
    """The same of a valve of the examination."""
    rng = np.random.default_rng([seed, 0])
    valve = draws.valve(rng)
    fitted, _ = draws.experiments(valve, rate, rng)
    return {name: float(getattr(valve, field)) for name, field in TRUTH.items()}, [experiment(r) for r in fitted]


def judged(rate: float, seeds: range, make: Callable[[int, float], tuple[dict[str, float], list[Experiment]]]) -> None:
    """Print what became of every valve that `make` gives at a rate, and the table of all."""
    errors: list[Array] = []
    claims: dict[str, list[tuple[str, float]]] = {}
    seconds, converged, orders = list[float](), 0, dict[str, int]()
    names: tuple[str, ...] = ()
    for seed in seeds:
        truth, experiments = make(seed, rate)
        start = time.process_time()
        found = fit(experiments)
        seconds.append(time.process_time() - start)
        orders[found.order] = orders.get(found.order, 0) + 1
        converged += found.outcome is Outcome.CONVERGED
        if not found.outcome.usable:
            print(f"  seed {seed}: {found.outcome.name}")
            continue
        known = uncertainty_of(found)
        names = known.names
        errors.append(np.array([100 * (found.values[n] / truth[n] - 1) for n in names]))
        off = {n: (found.values[n] - truth[n]) / known.spread[n] for n in names}
        for n in names:
            claims.setdefault(n, []).append((known.status[n], off[n]))
        wrong = [n for n in names if known.status[n] == "identified" and abs(off[n]) > GROSS]
        if wrong or found.outcome is not Outcome.CONVERGED:
            words = ", ".join(f"{n} {off[n]:+.1f} standard deviations" for n in wrong)
            print(f"  seed {seed}: {found.outcome.name} {words}", flush=True)
    print(f"{rate:g} Hz, {len(seeds)} valves: {converged} converged, orders {orders}; processor time a fit: median "
          f"{np.median(seconds):.1f} s, longest {max(seconds):.1f} s")  # fmt: skip
    for i, n in enumerate(names):
        z = np.array([off for status, off in claims[n] if status == "identified"])
        inside = f"{int(np.sum(np.abs(z) <= NORMAL_90))} covered" if len(z) else "none"
        gross = int(np.sum(np.abs(z) > GROSS))
        median = np.median(np.abs([e[i] for e in errors]))
        print(
            f"  {n:13} median error {median:8.3f} %, {len(z):3} identified, {inside} by 90 %, {gross} beyond {GROSS:g}"
        )


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--valves", type=int, default=25)
    options.add_argument("--first", type=int, default=9300, help="seed of the first valve")
    options.add_argument("--rates", type=float, nargs="+", default=[20.0, 50.0, 100.0, 200.0])
    options.add_argument("--positioner", action="store_true", help="valves of the examination, in a closed loop")
    asked = options.parse_args()
    print(machine("casadi", "numpy"))
    for rate in asked.rates:
        make = behind_a_positioner if asked.positioner else recordings
        judged(rate, range(asked.first, asked.first + asked.valves), make)


if __name__ == "__main__":
    main()
