"""The usual means: scipy's or lmfit's least squares around an adaptive integrator, with finite differences.

Each is stopped when it reaches the cost ours reached, when it gives up, or when its budget of time is spent.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable

import casadi as ca
import lmfit
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from recordings import Array, Recording

SMOOTH = 1e-7
"""Rounding of abs(v) in a programme that needs second derivatives [m/s]."""

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


def _transcribed(
    recording: Recording, p: Array, noise: float, wanted: float, budget: float
) -> tuple[float, float, str]:
    """All states as unknowns of one nonlinear programme: implicit midpoint between samples, solved by IPOPT with exact
    second derivatives, as somebody would write it by hand. It stops when IPOPT does, at any cost.
    """
    t, u = np.asarray(recording.time), np.asarray(recording["force"].values)
    y, n, h = np.asarray(recording["position"].values), len(recording), float(np.median(np.diff(recording.time)))
    scale = np.array([1e-2, 1e-1, 1e-5])[:, None]
    q, states = ca.MX.sym("q", len(p)), ca.MX.sym("s", 3, n)
    s = states * scale
    m, k, f0, fc, fs, vs, s0, s1, s2 = ca.vertsplit(q * p)
    middle, rise = (s[:, 1:] + s[:, :-1]) / 2, (s[:, 1:] - s[:, :-1]) / h
    x, v, z = middle[0, :], middle[1, :], middle[2, :]
    dz = v - s0 * ca.sqrt(v**2 + SMOOTH**2) / (fc + (fs - fc) * ca.exp(-((v / vs) ** 2))) * z
    force = 0.5 * (u[1:] + u[:-1])[None, :]
    balance = (force - k * x - f0 - s0 * z - s1 * dz - s2 * v) / (f0 + 1.0)
    law = ca.vertcat(rise[0, :] - v, m * rise[1, :] / (f0 + 1.0) - balance, rise[2, :] - dz)
    unknowns, cost = ca.vertcat(q, ca.vec(states)), ca.sumsqr((s[0, :] - y[None, :]) / noise)
    solver = ca.nlpsol(
        "transcribed", "ipopt", {"x": unknowns, "f": cost, "g": ca.vec(law)},
        {"print_time": False, "ipopt": {"print_level": 0, "max_cpu_time": budget, "max_iter": 3000}},
    )  # fmt: skip
    first = np.vstack([y, np.gradient(y, t), np.zeros(n)]) / scale
    start_s = time.perf_counter()
    start = np.concatenate([np.ones(len(p)), first.ravel(order="F")])
    found = solver(x0=start, lbg=0.0, ubg=0.0, lbx=np.concatenate([np.full(len(p), 1e-3), np.full(3 * n, -np.inf)]))
    seconds, said = time.perf_counter() - start_s, str(solver.stats()["return_status"])
    reached = float(found["f"]) / n
    return seconds, reached, f"{said}, {'reached' if reached <= wanted else 'not reached'}"


BASELINES: dict[str, Run] = {
    "scipy least_squares + solve_ivp LSODA": functools.partial(_scipy, "LSODA"),
    "scipy least_squares + solve_ivp Radau": functools.partial(_scipy, "Radau"),
    "lmfit leastsq + solve_ivp LSODA": functools.partial(_lmfit, "LSODA"),
    "states transcribed in CasADi, IPOPT": _transcribed,
}
"""The alternatives by name."""
