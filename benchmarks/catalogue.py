"""How fast the operators with memory follow a path, and how that grows with what they remember.

    python -m benchmarks.catalogue

Targets: Preisach and Leuven follow 10^6 samples in less than 1 s. Beside them the classical model by its sum (whose
time grows with the extrema remembered) and by direct integration over a plane of relays.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np

from benchmarks.machine import machine
from recordings import Array
from simulator.friction import LeuvenFriction
from simulator.hysteresis import Everett, LeuvenStack, Preisach

SEED = 1
SAMPLES = 1_000_000
TARGET = 1.0
"""Seconds for `SAMPLES`."""
RELAYS = 400
"""Relays along each side of the plane that is integrated directly."""


def everett(n: int = 41) -> Everett:
    """F of an even weight on n levels."""
    levels = np.linspace(0.0, 1.0, n)
    return Everett(levels, np.tril((levels[:, None] - levels[None, :]) ** 2 / 2, -1))


def straight(z: Array) -> Array:
    """A transition curve [N] of z [m]."""
    return 2e6 * z


def once(work: Callable[[], object]) -> float:
    """Seconds of processor time of some work, in one thread."""
    start = time.process_time()
    work()
    return time.process_time() - start


def seconds(work: Callable[[], object]) -> float:
    """Best of three runs."""
    return min(once(work) for _ in range(3))


def million() -> None:
    """Each operator along a random walk and along random values."""
    rng = np.random.default_rng(SEED)
    walk = np.cumsum(rng.normal(size=SAMPLES)) * 0.01
    paths = {"random walk": (walk - walk.min()) / np.ptp(walk), "random values": rng.uniform(0, 1, SAMPLES)}
    t = np.arange(SAMPLES) * 1e-3
    for name, path in paths.items():
        makers: dict[str, Callable[[], object]] = {
            "Preisach": lambda path=path: Preisach(everett(), 0.0, 1.0).follow(path),
            "LeuvenStack": lambda path=path: LeuvenStack(straight, 100.0).follow(1e-4 * path),
            "LeuvenFriction": lambda path=path: LeuvenFriction(
                straight, lambda v: 80 + 20 * np.exp(-(v**2) / 1e-4), sigma1=10.0
            ).follow(t, 1e-4 * path),
        }
        for operator, work in makers.items():
            work()
            found = seconds(work)
            print(f"{operator:15} {SAMPLES:.0e} samples, {name:13} {found:6.2f} s   target {TARGET:g} s")


def nested(reversals: int) -> Array:
    """Inputs whose every reversal is remembered: each loop lies within the one before."""
    k = np.arange(reversals)
    return 0.5 + 0.5 * (-1.0) ** k * (1 - k / reversals)


def growth() -> None:
    """Time of a sample with ever more extrema remembered."""
    print("time of a sample [us]   extrema   compiled   by the sum   Leuven")
    tail = 0.5 + 1e-9 * np.random.default_rng(SEED).uniform(-1, 1, 200_000)
    for reversals in (10, 100, 1000, 10_000):
        compiled, summed = Preisach(everett(), 0.0, 1.0), Preisach(everett(), 0.0, 1.0)
        stack = LeuvenStack(straight, 100.0)
        for model, scale in ((compiled, 1.0), (summed, 1.0), (stack, 1e-4)):
            model.follow(scale * nested(reversals))
        row = [once(lambda model=compiled: model.follow(tail)) / len(tail)]
        row.append(once(lambda model=summed: [model.update(float(u)) for u in tail[:20]]) / 20)
        row.append(once(lambda model=stack: model.follow(1e-4 * tail)) / len(tail))
        print(f"{'':23} {reversals:7d}   {1e6 * row[0]:8.2f}   {1e6 * row[1]:10.1f}   {1e6 * row[2]:6.2f}")


def direct() -> None:
    """The plane of relays itself: its time and how far it is from the sum."""
    edges = (np.arange(RELAYS) + 0.5) / RELAYS
    alpha, beta = np.meshgrid(edges, edges, indexing="ij")
    mu = np.where(alpha >= beta, 1.0, 0.0) / RELAYS**2 * np.where(alpha == beta, 0.5, 1.0)
    relay = -np.ones_like(mu)
    path = np.random.default_rng(SEED).uniform(0, 1, 200)
    expected = Preisach(lambda a, b: (a - b) ** 2 / 2, 0.0, 1.0).follow(path)
    found = np.empty_like(path)
    start = time.process_time()
    for k, u in enumerate(path):
        relay[alpha <= u], relay[beta >= u] = 1.0, -1.0
        found[k] = (mu * relay).sum()
    each = (time.process_time() - start) / len(path) * 1e6
    off = np.abs(found - expected).max()
    print(f"direct integration over {RELAYS} x {RELAYS} relays: {each:.0f} us a sample, off by {off:.4f}")


def main() -> None:
    """Print the table."""
    print(machine("numpy", "numba"))
    print(f"seed {SEED}, load average {', '.join(f'{load:.1f}' for load in os.getloadavg())}")
    million()
    growth()
    direct()


if __name__ == "__main__":
    main()
