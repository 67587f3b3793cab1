"""The plant of Section 4.4: (4.4)-(4.6), and (4.8)-(4.10) with a fault, by Runge and Kutta's fourth-order method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, fabs, sin, sqrt
from typing import Any, Literal

import numba
import numpy as np

from detector import Decisions, Observer, ObserverState
from recordings import Array

compiled: Callable[[Any], Any] = numba.njit
FaultName = Literal["none", "friction", "spring"]
FAULTS: dict[FaultName, int] = {"none": 0, "friction": 1, "spring": 2}

ONSET = 60.0
A1_TRUE, A4_TRUE, A5_TRUE = sqrt(2.0) + 0.4, 1.0, 1.0
"""(sigma1 + sigma2)/m, 1/m, K/m with m = 1, K = 1, sigma0 = 2, sigma1 = sqrt 2, sigma2 = 0.4."""


@dataclass(frozen=True)
class Run:
    """Times [s], position, velocity and bristle deflection, and the forces of the fault B1 or B2; all (n_samples,)."""

    t: Array
    x1: Array
    x2: Array
    z: Array
    b: Array

    @property
    def u(self) -> Array:
        """The input, 3 sin(0.2 t)."""
        return 3.0 * np.sin(0.2 * self.t)

    @property
    def samples(self) -> tuple[Array, Array, Array, Array]:
        """What the observer sees: time, position, input, velocity."""
        return self.t, self.x1, self.u, self.x2

    def __getitem__(self, part: slice) -> Run:
        return Run(self.t[part], self.x1[part], self.x2[part], self.z[part], self.b[part])

    @property
    def final(self) -> Array:
        """State at the end, shape (3,)."""
        return np.array([self.x1[-1], self.x2[-1], self.z[-1]])


def simulate(
    start_s: float, stop_s: float, dt: float, fault: FaultName = "none", state: Array | None = None,
    sigma2_printed: bool = False,
) -> Run:  # fmt: skip
    """From start to stop, a fault being there all the time. sigma2_printed : (4.2) as printed, with xdot for
    sigma2 xdot, that is sigma2 = 1. The faults are factors on F and K, not additions: F (1 + dF1), K (1 + dF2).
    """
    t: Array = start_s + dt * np.arange(round((stop_s - start_s) / dt) + 1).astype(np.float64)
    states: Array = np.zeros((len(t), 3))
    states[0] = np.zeros(3) if state is None else state
    b: Array = np.zeros(len(t))
    _run(t, dt, FAULTS[fault], 1.0 if sigma2_printed else 0.4, states, b)
    x1, x2, z = (np.ascontiguousarray(column) for column in states.T)
    return Run(t, x1, x2, z, b)


@compiled
def _rates(t: float, x1: float, x2: float, z: float, fault: int, sigma2: float) -> tuple[float, float, float, float]:
    bristle = fabs(x2) * 2.0 / (1.0 + 0.5 * exp(-((x2 / 0.001) ** 2)))
    friction = (sqrt(2.0) * bristle - 2.0) * z - (sqrt(2.0) + sigma2) * x2
    b = friction * (20.0 + exp(min(10.0 * x2, 50.0))) if fault == 1 else x1 if fault == 2 else 0.0
    return x2, friction - x1 + 3.0 * sin(0.2 * t) + b, x2 - bristle * z, b


@compiled
def _run(t: Array, dt: float, fault: int, sigma2: float, states: Array, b: Array) -> None:
    for i in range(t.shape[0]):
        x1, x2, z = states[i]
        p1, p2, p3, b[i] = _rates(t[i], x1, x2, z, fault, sigma2)
        if i + 1 == t.shape[0]:
            break
        h = 0.5 * dt
        q1, q2, q3, _ = _rates(t[i] + h, x1 + h * p1, x2 + h * p2, z + h * p3, fault, sigma2)
        r1, r2, r3, _ = _rates(t[i] + h, x1 + h * q1, x2 + h * q2, z + h * q3, fault, sigma2)
        s1, s2, s3, _ = _rates(t[i] + dt, x1 + dt * r1, x2 + dt * r2, z + dt * r3, fault, sigma2)
        states[i + 1, 0] = x1 + dt / 6.0 * (p1 + 2.0 * q1 + 2.0 * r1 + s1)
        states[i + 1, 1] = x2 + dt / 6.0 * (p2 + 2.0 * q2 + 2.0 * r2 + s2)
        states[i + 1, 2] = z + dt / 6.0 * (p3 + 2.0 * q3 + 2.0 * r3 + s3)


def model_error(run: Run, decisions: Decisions, observer: Observer) -> Array:
    """A of (4.29) along a run whose decisions were kept with their history; only a simulation knows it."""
    a1, a4, a5, xi1 = (decisions.past(name) for name in ("alpha1", "alpha4", "alpha5", "xi1"))
    xi2 = decisions.xi2
    bristle = np.abs(run.x2) * 2.0 / (1.0 + 0.5 * np.exp(-((run.x2 / 0.001) ** 2)))
    friction = (sqrt(2.0) * bristle - 2.0) * run.z
    phi = -decisions.phi * np.tanh(xi2 / observer.delta)
    off = (a1 - A1_TRUE) * (run.x2 - xi2) + (a5 - A5_TRUE) * (run.x1 - xi1) - (a4 - A4_TRUE) * run.u
    return -A5_TRUE * xi1 + friction + phi + off


def learned(observer: Observer, until_s: float = ONSET, dt: float = 1e-4) -> tuple[Run, ObserverState, Decisions]:
    """The plant without fault, and what the observer has made of it."""
    run = simulate(0.0, until_s, dt)
    state, decisions = observer.run(observer.initial(), *run.samples)
    return run, state, decisions
