"""The recording that every peer gets, what an engineer would guess beforehand, and how an answer is scored."""

from __future__ import annotations

import inspect
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from recordings import Array
from simulator import Excitation, Sensors, random_valve, simulate

SEED, RATE_HZ, NOISE = 4711, 100.0, 1e-4
NAMES = ("m", "K", "F0", "fc", "fs", "vs", "sigma0", "sigma1", "sigma2")
WRONG = np.array([1.3, 1.1, 0.9, 1.5, 1.4, 2.0, 0.4, 2.0, 0.5])
"""By which factors the guesses of a data sheet are wrong. Ours gets no guesses."""
BUDGET_S = float(os.environ.get("BRISTLE_PEER_SECONDS", "120"))
"""Processor time that a peer has."""


class Work:
    """Time [s], force [N] and position [m] of the recording and of one held out; truth and guesses (9,)."""

    def __init__(self) -> None:
        values, stroke = random_valve(SEED)
        self.truth = np.array(list(values.values()))
        self.guess = self.truth * WRONG
        self.noise = NOISE * stroke
        made = [
            simulate(values, Excitation.parse(course), Sensors(RATE_HZ, self.noise), stroke=stroke, seed=SEED + i)[0]
            for i, course in enumerate(("mixed:20", "staircase:10,sine:10"))
        ]
        self.recordings = made
        (self.t, self.u, self.y), self.held_out = (
            (np.asarray(r.time), np.asarray(r["force"].values), np.asarray(r["position"].values)) for r in made
        )


def lugre(t: float, s: Array, p: Array, times: Array, force: Array) -> list[float]:
    """Rates of position, velocity and bristle."""
    m, K, F0, fc, fs, vs, s0, s1, s2 = p
    x, v, z = s
    dz = v - s0 * abs(v) / (fc + (fs - fc) * np.exp(-((v / vs) ** 2))) * z
    return [v, (np.interp(t, times, force) - K * x - F0 - s0 * z - s1 * dz - s2 * v) / m, dz]


def free_run(p: Array, t: Array, u: Array, y: Array) -> Array:
    """Position [m] from the force alone, by LSODA; infinite where the integrator gives up."""
    start = [y[0], 0.0, (u[0] - p[1] * y[0] - p[2]) / p[6]]
    with np.errstate(all="ignore"):
        run = solve_ivp(lugre, t[[0, -1]], start, "LSODA", t, args=(p, t, u), rtol=1e-7, atol=1e-10, max_step=0.05)
    return np.asarray(run.y[0]) if run.success else np.full(len(t), np.inf)


def scored(name: str, solve: Callable[[Work], tuple[Array, str]]) -> None:
    """Run a peer and print its row. solve : gives nine parameters, NaN where the peer has none, and words."""
    work = Work()
    started = time.process_time()
    p, words = solve(work)
    seconds = time.process_time() - started
    error = 100.0 * np.abs(p / work.truth - 1.0)
    shown = " | ".join("-" if np.isnan(error[i]) else f"{error[i]:.2g}" for i in (1, 3, 4, 6))
    run = "-"
    if np.isfinite(p).all():
        t, u, y = work.held_out
        run = f"{np.sqrt(np.mean((free_run(p, t, u, y) - y) ** 2)) / work.noise:.3g}"
    lines = sum(bool(line.strip()) for line in Path(inspect.getfile(solve)).read_text(encoding="utf-8").splitlines())
    print(f"| {name} | {lines} | {seconds:.1f} | {shown} | {run} | {words} |", flush=True)


class OutOfTime(Exception):
    """The budget of processor time is spent."""


class Residual:
    """Free run less record in noise units, for factors on the guess; keeps the best, stops at the budget."""

    def __init__(self, work: Work) -> None:
        self.work, self.best, self.q = work, np.inf, np.ones(len(NAMES))
        self.started, self.calls = time.process_time(), 0

    def __call__(self, q: Array) -> Array:
        if time.process_time() - self.started > BUDGET_S:
            raise OutOfTime
        w = self.work
        r = (free_run(np.asarray(q) * w.guess, w.t, w.u, w.y) - w.y) / w.noise
        r = np.where(np.isfinite(r), r, 1e4)
        self.calls += 1
        cost = float(np.sqrt(np.mean(r**2)))
        if cost < self.best:
            self.best, self.q = cost, np.array(q, float)
        return r

    def answer(self, why: str) -> tuple[Array, str]:
        """The best parameters so far, and words."""
        return self.q * self.work.guess, f"{why}; {self.calls} free runs, residual {self.best:.3g} times the noise"
