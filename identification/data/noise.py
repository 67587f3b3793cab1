"""Noise levels from the recording itself."""

from __future__ import annotations

import numpy as np

from recordings import Array, quiet_noise

ORDER = 4
"""Of the difference: the fourth removes every cubic."""

ROUNDING = 64 * float(np.finfo(float).eps)
"""Least noise, as a share of the largest value: what arithmetic itself may leave."""


def noise_std(signal: Array, quantum: float = 0.0, t: Array | None = None) -> float:
    """Standard deviation of the white noise on a signal (n_samples,), in its unit; NaN samples are passed over.

    `recordings.quiet_noise` with the fourth difference; at least the noise of the quantisation step, `quantum` or the
    smallest step seen, uniformly distributed.
    t (n_samples,) : times of the samples [s], strictly increasing, where they may be unevenly spaced.

    >>> import numpy as np
    >>> t = np.linspace(0.0, 10.0, 2000)
    >>> round(noise_std(np.sin(t) + np.random.default_rng(1).normal(0.0, 0.01, 2000)), 3)
    0.01
    """
    signal = np.asarray(signal, float)
    known = np.isfinite(signal)
    if not known.all():  # a slow sensor leaves every other sample out
        t = (np.arange(len(signal), dtype=float) if t is None else t)[known]
        signal = signal[known]
    white = quiet_noise(signal, ORDER, t)
    span, size = (float(np.ptp(signal)), float(np.abs(signal).max())) if len(signal) else (0.0, 0.0)
    return max(white, (quantum or _smallest_step(signal)) / np.sqrt(12.0), 1e-9 * span, ROUNDING * size)


def _smallest_step(signal: Array) -> float:
    """The quantisation step where a signal takes few distinct, evenly spaced values; else 0."""
    values = np.unique(signal[np.isfinite(signal)])
    if len(values) < 3 or len(values) > 0.5 * len(signal):
        return 0.0
    steps = np.diff(values)
    quantum = float(steps[steps > 1e-12 * np.ptp(values)].min(initial=np.inf))
    whole = steps / quantum
    return quantum if np.isfinite(quantum) and np.all(np.abs(whole - np.round(whole)) < 0.05) else 0.0
