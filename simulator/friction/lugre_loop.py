"""The loop of `simulate_servo`, compiled by numba."""

from __future__ import annotations

import numpy as np

from simulator.hysteresis.masing import native


@native
def bristle(z, v, h, model, drive):  # type: ignore[no-untyped-def]
    """z and its mean rate after a step h [s] of dz/dt = v - abs(v) z/g + drive, v and drive held: exact."""
    sigma0, fc, fs, vs = model[0], model[3], model[4], model[5]
    rate = abs(v) * sigma0 / (fc + (fs - fc) * np.exp(-((v / vs) ** 2)))
    y = rate * h
    phi = 1 - y / 2 if y < 1e-6 else (1 - np.exp(-y)) / y
    change = h * phi * (v + drive - rate * z)
    return z + change, change / h


@native
def run(rows, step, true, believed, design, compensation, velocity, start, out):  # type: ignore[no-untyped-def]
    """Fill out (5, n_samples): x, v, error, friction, estimate; rows (n_samples, 3): reference and its derivatives."""
    mass, kp, kd, ki, K = design
    x, v, z, guess, area, before = start[0], start[1], start[2], 0.0, 0.0, 0.0
    for k in range(len(rows)):
        if velocity:
            error, ahead = v - rows[k, 1], rows[k, 2]
            pace = (error - before) / step if k else 0.0
            before = error
        else:
            error, ahead = x - rows[k, 0], rows[k, 2]
            pace = v - rows[k, 1]
        area += error * step
        guess, guessed = bristle(guess, v, step, believed, -K * error)
        estimate = believed[0] * guess + believed[1] * guessed + believed[2] * v
        z, rate = bristle(z, v, step, true, 0.0)
        friction = true[0] * z + true[1] * rate + true[2] * v
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = x, v, error, friction, estimate
        u = mass * ahead - kp * error - kd * pace - ki * area
        if compensation:
            u += estimate
        v += step * (u - friction) / mass
        x += step * v


@native
def follow(steps, speeds, model, out):  # type: ignore[no-untyped-def]
    """Fill out (n_samples) after the first with the friction along moves of duration `steps` at `speeds`."""
    z = 0.0
    for k in range(len(steps)):
        z, rate = bristle(z, speeds[k], steps[k], model, 0.0)
        out[k + 1] = model[0] * z + model[1] * rate + model[2] * speeds[k]
