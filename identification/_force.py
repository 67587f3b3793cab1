"""What is known of the force between and behind its noisy samples, before any model of the valve is used.

The force is taken for the integral of a slope that is driven by white noise. How strongly differs along a recording (a
ramp, a corner, a step), so the intensity is estimated locally: first one for all by maximum likelihood, then from the
energy of the smoothed slope's jumps within 60 ms.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from importlib import resources
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from simulator import native_module

Array = NDArray[np.float64]

LOCAL = 0.06
"""Time over which the intensity is one [s]."""
SHARED = 0.05
"""Share of the mean intensity that every place has at least."""
ROUNDS = 3
DECADES = np.arange(-2.0, 16.0)
"""Intensities that are tried first, in powers of ten of the noise variance per cubic second."""


@dataclass(frozen=True)
class Force:
    """u (n,) smoothed force [N], slope (n,) [N/s], std (n,) its standard deviation [N]; intensity (n - 1,) [N2/s3] of
    the noise that drives the slope; noise [N] of the samples."""

    u: Array
    slope: Array
    std: Array
    intensity: Array
    noise: float


@functools.cache
def loops() -> ModuleType:
    """The compiled recursions of `_loops.py`."""
    text = resources.files("identification").joinpath("_loops.py").read_text(encoding="utf-8")
    return native_module("smoother", text)


def estimate_force(t: Array, u: Array, noise: float) -> Force:
    """Smooth the force u (n,) [N] recorded at t (n,) [s] with a noise of standard deviation `noise` [N].

    The standard deviations hold within about a tenth on forces made of ramps, sines and steps.
    """
    mean, P, jumps = np.empty((len(t), 2)), np.empty((len(t), 2, 2)), np.empty(len(t) - 1)
    r, dt = noise**2, np.diff(t)

    def smooth(intensity: Array) -> float:
        return float(loops().smoothed_force(t, u, intensity, r, mean, P, jumps))

    levels = r * 10.0**DECADES
    best = levels[int(np.argmax([smooth(np.full(len(dt), level)) for level in levels]))]
    intensity = np.full(len(dt), best)
    width = max(3, round(LOCAL / float(np.median(dt))) | 1)
    for _ in range(ROUNDS):
        smooth(intensity)
        local = np.convolve(np.pad(jumps / dt, width // 2, mode="edge"), np.ones(width) / width, "valid")
        intensity = (1 - SHARED) * local + SHARED * float(local.mean())
    smooth(intensity)
    std = np.sqrt(np.maximum(P[:, 0, 0], 1e-12 * r))
    return Force(mean[:, 0].copy(), mean[:, 1].copy(), std, intensity, noise)
