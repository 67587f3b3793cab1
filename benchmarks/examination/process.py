"""A control loop around the valve without a positioner: the controller's output is the pressure, 0 to 100 %."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from benchmarks.examination.plant import Valve, stem_step
from recordings import Array

SCAN_S = 1.0


@njit(cache=True, error_model="numpy")
def _loop(q, setpoint, low, span, gain, Ti, T, delay, disturbance, noise, step):
    """SP, PV, OP [%] at every scan: a first-order process with a delay of whole scans, a PI controller in velocity
    form."""
    n = len(setpoint)
    out = np.empty((n, 3))
    x, v, z, pv, op, before = 0.5 * q.stroke, 0.0, 0.0, 50.0, 50.0, 0.0
    flows = np.full(delay + 1, 50.0)
    p = low + 0.5 * span
    parts = round(SCAN_S / step)
    for k in range(n):
        shown = pv + noise[k]
        error = setpoint[k] - shown
        op = min(max(op + gain * (error - before + SCAN_S / Ti * error), 0.0), 100.0)
        before = error
        out[k, 0], out[k, 1], out[k, 2] = setpoint[k], shown, op
        for i in range(parts):
            p += (1.0 - math.exp(-step / q.filling)) * (low + span * op / 100.0 - p)
            x, v, z = stem_step(k * SCAN_S + i * step, step, x, v, z, q.area * p, q)
        flows[k % (delay + 1)] = 100.0 * x / q.stroke
        late = flows[(k + 1) % (delay + 1)]
        pv += (1.0 - math.exp(-SCAN_S / T)) * (late + disturbance[k] - pv)
    return out


def loop(valve: Valve, cause: str, n: int, rng: np.random.Generator, step: float = 4e-5) -> Array:
    """SP, PV and OP [%], (n, 3), of a flow loop.

    cause : ``stiction``, ``tuning`` (a controller at the edge of stability) or ``disturbance`` (a load that comes and
    goes); the last two have hardly any friction.
    """
    share = rng.uniform(0.04, 0.12) if cause == "stiction" else 0.003
    span_N = valve.K * valve.stroke
    fc = share * span_N / 2.0
    q = valve._replace(fc=fc, fs=fc * rng.uniform(1.3, 1.8), sigma0=fc / 2e-5, sigma1=0.0, sigma2=2.0 * fc)
    q = q._replace(sigma1=2.0 * np.sqrt(q.sigma0 * q.m) * 0.5)
    T, delay = rng.uniform(3.0, 8.0), int(rng.integers(1, 4))
    critical = np.pi * T / (2.0 * (delay + 0.5))  # of a proportional controller, about
    gain, Ti = (critical if cause == "tuning" else rng.uniform(0.15, 0.4) * critical), T
    t = SCAN_S * np.arange(n)
    disturbance = np.zeros(n)
    if cause == "disturbance":
        disturbance = rng.uniform(4.0, 10.0) * np.sin(2 * np.pi * t / rng.uniform(25.0, 60.0) + rng.uniform(0.0, 6.0))
    noise = rng.normal(0.0, 0.1, n)
    setpoint = 50.0 + np.repeat(rng.uniform(-5.0, 5.0, n // 800 + 1), 800)[:n]
    low, span = q.F0 / q.area, span_N / q.area
    whole = Valve(*map(float, q))
    return np.asarray(_loop(whole, setpoint, low, span, gain, Ti, T, delay, disturbance, noise, step))
