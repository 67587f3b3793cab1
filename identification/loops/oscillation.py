"""Oscillations of a loop: zero crossings of the autocorrelation.

Thornhill, Huang and Zhang (2003), Detection of multiple oscillations in control loops, J. Process Control 13, 91-100:
intervals of the zero crossings have mean m and standard deviation s; regularity r = m / (3 s) above 1 is an oscillation
of period 2 m. Every peak of the spectrum is filtered out and judged by itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.loops.loop import ControlLoop
from recordings import Array

CROSSINGS = 10
"""Zero crossings that are looked at."""
PEAKS = 3
LEAST = 0.08
"""Share of the power that an oscillation has at least."""


@dataclass(frozen=True)
class Oscillation:
    """period_s; regularity : above 1 is regular; share : of the power of the controller error."""

    period_s: float
    regularity: float
    share: float


def oscillations(loop: ControlLoop) -> tuple[Oscillation, ...]:
    """The regular oscillations of the controller error, the strongest first.

    Harmonics and neighbouring peaks count with them.
    """
    error = loop.error - _trend(loop.error)
    n = len(error)
    spectrum = np.fft.rfft(error * np.hanning(n))
    power = np.abs(spectrum) ** 2
    power[:2] = 0.0
    total = float(power.sum())
    found: list[Oscillation] = []
    left = power.copy()
    for _ in range(PEAKS):
        peak = int(np.argmax(left))
        if total <= 0 or left[peak] <= 0 or peak < 2:
            break
        low, high = max(1, int(0.6 * peak)), int(np.ceil(1.4 * peak)) + 1
        share = float(power[low:high].sum()) / total
        left[low:high] = 0.0
        band = np.zeros(len(power))
        band[low:high] = 1.0
        period, regularity = _regularity(np.fft.irfft(np.fft.rfft(error) * band, n))
        harmonic = any(abs(one.period_s / (period * loop.dt) - k) < 0.1 * k for one in found for k in (1, 2, 3, 4, 5))
        if share > LEAST and regularity > 1.0 and not harmonic:
            found.append(Oscillation(period * loop.dt, regularity, share))
    return tuple(found)


def _trend(values: Array) -> Array:
    x = np.arange(len(values))
    return np.asarray(np.polyval(np.polyfit(x, values, 1), x), float)


def _regularity(values: Array) -> tuple[float, float]:
    """Period [samples] and regularity of a filtered signal."""
    n = len(values)
    spectrum = np.abs(np.fft.rfft(values, 2 * n)) ** 2
    lagged = np.fft.irfft(spectrum)[: n * 3 // 4]
    signs = np.sign(lagged)
    crossings = np.flatnonzero(signs[:-1] * signs[1:] < 0)
    if len(crossings) < 4:
        return float(n), 0.0
    part = lagged[crossings] / (lagged[crossings] - lagged[crossings + 1])
    gaps = np.diff((crossings + part)[: CROSSINGS + 1])
    spread = float(np.std(gaps, ddof=1))
    return 2 * float(np.mean(gaps)), min(float(np.mean(gaps)) / (3 * spread), 100.0) if spread > 0 else 100.0
