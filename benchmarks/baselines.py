"""The usual means: scipy's or lmfit's least squares around an adaptive integrator, with finite differences.

Each is stopped when it reaches the cost ours reached, when it gives up, or when its budget of time is spent.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable

import lmfit
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from recordings import Array, Recording

Run = Callable[[Recording, Array, float, float, float], tuple[float, float, str]]


class _Reached(Exception):
    """The wanted cost is reached, or the time is spent."""


class _Residual:
    """Residual of a LuGre valve integrated by solve_ivp, with the stopping rule."""

    def __init__(self, recording: Recording, method: str, noise: float, wanted: float, budget: float) -> None:
        self.t, self.u = np.asarray(recording.time), np.asarray(recording["force"].values)
        self.y, self.method, self.noise = np.asarray(recording["position"].values), method, noise
        self.wanted, self.budget, self.best = wanted, budget, np.inf
        self.start = time.perf_counter()

    def rhs(self, t: float, s: Array, p: Array) -> list[float]:
        m, k, f0, fc, fs, vs, s0, s1, s2 = p
        x, v, z = s
        dz = v - s0 * abs(v) / (fc + (fs - fc) * np.exp(-((v / vs) ** 2))) * z
        return [v, (np.interp(t, self.t, self.u) - k * x - f0 - s0 * z - s1 * dz - s2 * v) / m, dz]

    def __call__(self, p: Array) -> Array:
        start = [self.y[0], 0.0, (self.u[0] - p[1] * self.y[0] - p[2]) / p[6]]
        with np.errstate(all="ignore"):
            run = solve_ivp(
                self.rhs, self.t[[0, -1]], start, self.method, self.t, args=(p,), rtol=1e-7, atol=1e-10, max_step=0.05
            )
        r = np.full(len(self.t), 1e3)
        if run.success and np.isfinite(run.y[0]).all():
            r = (run.y[0] - self.y) / self.noise
        cost = float(np.mean(r**2))
        self.best = min(self.best, cost)
        if cost <= self.wanted or time.perf_counter() - self.start > self.budget:
            raise _Reached
        return r


def _stopped(residual: _Residual, work: Callable[[], object]) -> tuple[float, float, str]:
    why = "gave up before the wanted cost"
    try:
        work()
    except _Reached:
        why = "reached the same cost" if residual.best <= residual.wanted else "out of time"
    return time.perf_counter() - residual.start, residual.best, why


def _scipy(
    method: str, recording: Recording, p: Array, noise: float, wanted: float, budget: float
) -> tuple[float, float, str]:
    residual = _Residual(recording, method, noise, wanted, budget)
    scaled = functools.partial(least_squares, lambda q: residual(q * p), np.ones(len(p)), diff_step=1e-4)
    return _stopped(residual, lambda: scaled(bounds=(1e-3, 1e3)))


def _lmfit(
    method: str, recording: Recording, p: Array, noise: float, wanted: float, budget: float
) -> tuple[float, float, str]:
    residual = _Residual(recording, method, noise, wanted, budget)
    parameters = lmfit.Parameters()
    for i in range(len(p)):
        parameters.add(f"q{i}", value=1.0, min=1e-3, max=1e3)
    values = lambda q: np.array([q[f"q{i}"].value for i in range(len(p))])  # noqa: E731
    return _stopped(residual, lambda: lmfit.minimize(lambda q: residual(values(q) * p), parameters, epsfcn=1e-8))


BASELINES: dict[str, Run] = {
    "scipy least_squares + solve_ivp LSODA": functools.partial(_scipy, "LSODA"),
    "scipy least_squares + solve_ivp Radau": functools.partial(_scipy, "Radau"),
    "lmfit leastsq + solve_ivp LSODA": functools.partial(_lmfit, "LSODA"),
}
"""The alternatives by name."""
