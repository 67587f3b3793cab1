"""Smoothed motion of a recorded position: only for starting values and resets, never for the final fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter

from recordings import Array

WIDEST = 0.024
"""Widest smoothing window [s], at least `FEWEST` samples; where the noise is low a narrower one blurs less."""
FEWEST = 5
QUIET = 0.02
"""The window is as narrow as keeps the noise of the acceleration below this share of the acceleration itself, rms."""
DEAD_ZONE = 2.0
"""Half width of the dead zone on the displacement, in standard deviations of the noise. Without it the noise rectifies
through abs(v) and relaxes a reconstructed bristle."""


@dataclass(frozen=True)
class Motion:
    """x [m], v [m/s], a [m/s2], each (n_samples,); crept : velocity [m/s] behind the dead zone."""

    x: Array
    v: Array
    a: Array
    crept: Array


def smooth(t: Array, y: Array, noise: float) -> Motion:
    """Savitzky-Golay smoothing (third order) of a position, at times of any spacing.

    t (n_samples,) : times [s], increasing; y (n_samples,) : position [m]; noise : its standard deviation [m].
    """
    dt = float(np.median(np.diff(t)))
    even = np.allclose(np.diff(t), dt, rtol=1e-3, atol=0.0)
    grid = t if even else np.linspace(t[0], t[-1], max(round((t[-1] - t[0]) / dt) + 1, FEWEST))
    signal = y if even else np.interp(grid, t, y)
    step = float(grid[1] - grid[0])
    window = _window(signal, step, noise)
    x, v, a = (savgol_filter(signal, window, 3, deriv=d, delta=step) for d in range(3))
    if not even:
        x, v, a = (np.interp(t, grid, z) for z in (x, v, a))
    crept = np.gradient(play(x, DEAD_ZONE * noise), t)
    return Motion(x, v, a, crept)


def _window(signal: Array, step: float, noise: float) -> int:
    """Width of the smoothing window in samples, odd."""
    largest = 2 * ((len(signal) - 1) // 2) + 1
    widest = min(max(2 * round(WIDEST / step / 2) + 1, FEWEST), largest)
    for window in range(FEWEST, widest, 2):
        blurred = savgol_filter(signal, window, 3, deriv=2, delta=step)
        gain = float(np.linalg.norm(savgol_coeffs(window, 3, deriv=2, delta=step)))
        if noise * gain < QUIET * float(np.std(blurred)):
            return window
    return widest


def play(x: Array, half_width: float) -> Array:
    """The play operator: follows x only when it leaves a band of `half_width` about the last output.

    x (n_samples,) and half_width in one unit, as the answer (n_samples,).
    """
    if half_width <= 0:
        return x.copy()
    followed = np.empty_like(x)
    now = x[0]
    for i, value in enumerate(x.tolist()):
        now = min(max(now, value - half_width), value + half_width)
        followed[i] = now
    return followed
