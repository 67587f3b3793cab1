"""The valve that is examined on: LuGre friction behind a pneumatic actuator and a positioner that closes the loop.

    m dv/dt = A p - K x (1 - fade t) - F0 - k3 (x - x_m)**3 - d abs(v)**1.8 sgn(v) - F
    F       = sigma0 z + sigma1 dz/dt + sigma2 v
    dz/dt   = v - sigma0 abs(v) z / g,    g = (fc + (fs - fc) exp(-(v/vs)**2)) (1 + spot of a triangle) (1 + worn)
    dp/dt   = (p_demand - p) / T,    0 <= p_demand <= SUPPLY times what the full stroke takes

The bristle is advanced by its exact solution at constant velocity, in two halves around a step of the velocity by the
trapezoidal rule, and so is the position (a splitting in Strang's way): neither the scheme nor the step nor the code of
`simulator` or of `benchmarks.plants`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from recordings import Array

STEP_S = 2e-5
KEPT_S = 1e-3
HELD = 5
CONTROL_S = HELD * KEPT_S
"""Steps of the plant, between two kept values, and between two answers of the positioner [s]."""
SUPPLY = 2.0
"""Pressure that is at hand, in what the full stroke takes."""
LATE = 256
"""Past pressures that are kept, more than the longest dead time."""


class Valve(NamedTuple):
    """Base parameters in SI units, and what else the valve does; each of these is off at zero."""

    m: float
    K: float
    F0: float
    fc: float
    fs: float
    vs: float
    sigma0: float
    sigma1: float
    sigma2: float
    area: float  # m2
    stroke: float  # m
    filling: float  # s, of the chamber
    gain: float  # Pa/m, of the positioner
    integral: float  # Pa/(m s)
    spot: float = 0.0  # share, in a triangle around spot_x
    spot_x: float = 0.0  # m
    spot_w: float = 1.0  # m
    k3: float = 0.0  # N/m3
    drag: float = 0.0  # N (s/m)**1.8
    fade: float = 0.0  # 1/s, of the spring
    play: float = 0.0  # m, between stem and sensor
    sensor_lag: float = 0.0  # s
    dead: float = 0.0  # s, of the force behind the recorded pressure
    gust: float = 0.0  # N, root mean square of a random force
    gust_s: float = 0.5  # s, its correlation time
    worn: float = 0.0  # share of friction that comes at worn_at
    worn_at: float = 1e9  # s


njit_quick = njit(cache=True, error_model="numpy")


@njit_quick
def _level(x, v, t, q):
    g = q.fc + (q.fs - q.fc) * math.exp(-((v / q.vs) ** 2))
    g *= 1.0 + q.spot * max(0.0, 1.0 - abs(x - q.spot_x) / q.spot_w)
    return g * (1.0 + q.worn) if t >= q.worn_at else g


@njit_quick
def _bristle(h, x, v, z, t, q):
    """The bristle after h seconds at constant velocity: exact."""
    if v == 0.0:
        return z
    rate = q.sigma0 / _level(x, v, t, q)
    end = (1.0 if v > 0.0 else -1.0) / rate
    return end + (z - end) * math.exp(-rate * abs(v) * h)


@njit_quick
def stem_step(t, h, x, v, z, force, q):
    """One step of position, velocity and bristle under a force [N]: half a step of position and bristle, a whole one of
    the velocity by the trapezoidal rule, and the other halves."""
    z = _bristle(0.5 * h, x, v, z, t, q)
    x += 0.5 * h * v
    slope = 1.0  # dz/dt = slope v
    if v != 0.0:
        slope -= q.sigma0 * z / _level(x, v, t, q) * (1.0 if v > 0.0 else -1.0)
    away = x - 0.5 * q.stroke
    push = force - q.K * x * (1.0 - q.fade * t) - q.F0 - q.k3 * away**3 - q.sigma0 * z
    viscous = q.sigma1 * slope + q.sigma2
    if q.drag > 0.0:
        viscous += q.drag * abs(v) ** 0.8
    part = 0.5 * h * viscous / q.m
    v = (v * (1.0 - part) + h * push / q.m) / (1.0 + part)
    x += 0.5 * h * v
    return x, v, _bristle(0.5 * h, x, v, z, t, q)


@njit_quick
def _run(setpoint, gusts, q, step):
    n = len(gusts)
    out = np.empty((n, 3))
    x, v, z, sensed, lagged = setpoint[0], 0.0, 0.0, setpoint[0], setpoint[0]
    p = (q.K * x + q.F0) / q.area
    total, demand, gust, supply = p, p, 0.0, SUPPLY * (q.K * q.stroke + q.F0) / q.area
    past = np.full(LATE, p)
    parts = max(round(KEPT_S / step), 1)
    h, keep = KEPT_S / parts, math.exp(-KEPT_S / q.gust_s)
    back = round(q.dead / KEPT_S)
    for k in range(n):
        out[k, 0], out[k, 1], out[k, 2] = lagged, p, x
        past[k % LATE] = p
        if k % HELD == 0:
            error = setpoint[k // HELD] - lagged
            total = min(max(total + q.integral * error * CONTROL_S, 0.0), supply)
            demand = min(max(total + q.gain * error, 0.0), supply)
        gust = keep * gust + math.sqrt(1.0 - keep * keep) * q.gust * gusts[k]
        for i in range(parts):
            before, p = p, demand + (p - demand) * math.exp(-h / q.filling)
            acting = 0.5 * (before + p) if back == 0 else past[(k - back) % LATE]
            x, v, z = stem_step(k * KEPT_S + i * h, h, x, v, z, q.area * acting + gust, q)
        sensed = min(max(sensed, x - 0.5 * q.play), x + 0.5 * q.play)
        part = 1.0 if q.sensor_lag == 0.0 else 1.0 - math.exp(-KEPT_S / q.sensor_lag)
        lagged += part * (sensed - lagged)
    return out


def run(valve: Valve, setpoint: Array, rng: np.random.Generator, step: float = STEP_S) -> Array:
    """The positioner follows a set point [m] of one value each `CONTROL_S`.

    Gives, (HELD n, 3), one row each `KEPT_S`: reading [m], pressure [Pa], stem [m].
    """
    q = Valve(*map(float, valve))
    n = HELD * len(setpoint)
    gusts = rng.standard_normal(n) if q.gust else np.zeros(n)
    return np.asarray(_run(np.asarray(setpoint, float), gusts, q, step))
