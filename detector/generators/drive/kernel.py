"""Positioner and servomotor of a valve, reduced to what set point, pressure drop and position can teach."""

from __future__ import annotations

from math import asin, fabs, sqrt

import numpy as np

from detector.arithmetic.native import native
from recordings import Array

SYMBOLS = (
    "gain", "dead", "fill", "vent", "spring", "preload", "plug", "play", "damp", "volume", "lag", "leak", "supply",
    "recovery", "friction", "scale", "offset",
)  # fmt: skip
"""Constants of the model: gain of the positioner and edge of its dead zone [1]; openings of the relay when it fills and
vents [1]; rise of the chamber pressure over the stroke, and at its start [Pa]; plug over diaphragm area [1]; play
[share of the stroke]; damping [Pa s]; dead volume [volume of the stroke]; lag of the set-point filter [s]; leak
[1/(s Pa^0.5)]; supply [Pa]; fall of the plug's pressure recovery [1]; friction [Pa]; scale of the sensor that the
positioner reads [1]; offset of the set point [1]."""

STATES = 6
"""Two filter states, air, rod ahead of the play, rod, time since the positioner sampled."""

_ATMOSPHERE = 101325.0
_HOLD = 0.0349
"""The positioner samples every 35 ms [s]."""
_DEGREES_60 = 1.0471975511965976
_CONDUCTANCE = 2.5e-6 * 287.0 * 293.0 / _ATMOSPHERE / 0.029 / 0.0381
"""Air through an open relay of the name-plate size [volume of the stroke / (s Pa^0.5)]."""


@native
def recovery(y: float, fall: float) -> float:
    """Pressure recovery Km of the plug at a closing y [1]: 1 open, about 0.4 closed."""
    return 1.0 - fall * (0.5 * y + 0.1 * y * y * y)


@native
def _relay(e: float, dead: float) -> float:
    """Opening of the relay: a dead zone, filling stronger than venting (venting in shares of its own maximum)."""
    if e > dead:
        return min(0.02 + (e - dead) / 0.4 * 0.98, 1.0)
    if e < -dead - 0.08:
        return max(-0.02 + (e + dead + 0.08) / 0.4 * 0.98, -1.0)
    return (e + 0.04) / (dead + 0.04) * 0.02


@native
def _flow(opening: float, p: float, th: Array) -> float:
    """Change of the air [volume of the stroke per second at atmospheric pressure]."""
    leak = th[11] * sqrt(max(p, 0.0))
    if opening > 0.0:
        return _CONDUCTANCE * th[2] * opening * sqrt(max(th[12] - p, 0.0)) - leak
    return _CONDUCTANCE * th[3] * opening * sqrt(max(p, 0.0)) - leak


@native
def _speed(p: float, y: float, drop: float, th: Array) -> float:
    """Speed of the rod [1/s] under its net pressure, of which friction takes its part."""
    net = p - th[6] * drop / recovery(y, th[13]) - (th[5] + th[4] * y)
    friction = th[14]
    net = net - friction if net > friction else (net + friction if net < -friction else 0.0)
    if (y <= 0.0 and net < 0.0) or (y >= 1.0 and net > 0.0):
        return 0.0
    return net / th[8]


@native
def advance(state: Array, past: Array, setpoint: Array, drop: Array, th: Array, n: int, out: Array) -> None:
    """One second per sample, n steps each, changing `state` (6,) and `past` (2,) in place; out : position [1].

    past : the set point before, and the opening of the relay; drop (n_samples, parts) : pressure drop over each second
    [Pa]; th : constants, in the order of `SYMBOLS`.
    """
    parts = drop.shape[1]
    dt = 1.0 / n
    for k in range(setpoint.shape[0]):
        for j in range(n):
            s = (j + 1.0) * dt
            target = past[0] + (setpoint[k] - past[0]) * s + th[16]
            state[0] += dt * (target - state[0]) / th[10]
            state[1] += dt * (state[0] - state[1]) / th[10]
            y = state[4]
            if state[5] <= 0.0:
                lever = min(max(y * th[15] - 0.5, -0.866), 0.866)
                error = th[0] * (state[1] - (asin(lever) / _DEGREES_60 + 0.5))
                past[1] = _relay(error, th[1])
                state[5] += _HOLD
            state[5] -= dt
            volume = th[9] + y
            state[2] += dt * _flow(past[1], _ATMOSPHERE * state[2] / volume - _ATMOSPHERE, th)
            state[2] = max(state[2], 0.1 * volume)
            pressure = _ATMOSPHERE * state[2] / volume - _ATMOSPHERE
            state[3] = min(max(state[3] + dt * _speed(pressure, y, drop[k, j * parts // n], th), -0.05), 1.25)
            y = min(max(y, state[3] - 0.5 * th[7]), state[3] + 0.5 * th[7])
            state[4] = min(max(y, 0.0), 1.0)
        past[0] = setpoint[k]
        out[k] = min(state[4] * th[15], 1.0)
        if not fabs(out[k]) < 2.0:
            out[k] = np.nan
