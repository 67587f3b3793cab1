"""Noise levels from the recording itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
"""Fourth difference: it removes every cubic, so that what stays of a smooth signal is its white noise."""


def noise_std(signal: Array, quantum: float = 0.0) -> float:
    """Standard deviation of the white noise on a signal (n_samples,), in its unit; NaN samples are passed over.

    The median absolute fourth difference, scaled for a normal distribution (Hampel 1974); at least the noise of the
    quantisation step, `quantum` or the smallest step seen, uniformly distributed.
    """
    signal = np.asarray(signal, float)
    fourth = np.convolve(signal, _DIFFERENCE, "valid")
    fourth = fourth[np.isfinite(fourth)]
    white = float(np.median(np.abs(fourth)) / 0.6745 / np.sqrt(np.sum(_DIFFERENCE**2))) if len(fourth) else 0.0
    span = float(np.nanmax(signal) - np.nanmin(signal)) if np.isfinite(signal).any() else 0.0
    return max(white, (quantum or _smallest_step(signal)) / np.sqrt(12.0), 1e-9 * span)


def _smallest_step(signal: Array) -> float:
    """The quantisation step where a signal takes few distinct, evenly spaced values; else 0."""
    values = np.unique(signal[np.isfinite(signal)])
    if len(values) < 3 or len(values) > 0.5 * len(signal):
        return 0.0
    steps = np.diff(values)
    quantum = float(steps[steps > 1e-12 * np.ptp(values)].min(initial=np.inf))
    whole = steps / quantum
    return quantum if np.isfinite(quantum) and np.all(np.abs(whole - np.round(whole)) < 0.05) else 0.0
