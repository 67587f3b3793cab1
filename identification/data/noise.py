"""Noise levels from the recording itself."""

from __future__ import annotations

import numpy as np

from recordings import Array

_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
"""Fourth difference: it removes every cubic, so that what stays of a smooth signal is its white noise."""


ROUNDING = 64 * float(np.finfo(float).eps)
"""Least noise, as a share of the largest value: what arithmetic itself may leave."""
UNEVEN = 0.01
"""Relative spread of the sampling intervals from which the difference takes the times into account."""


def noise_std(signal: Array, quantum: float = 0.0, t: Array | None = None) -> float:
    """Standard deviation of the white noise on a signal (n_samples,), in its unit; NaN samples are passed over.

    The median absolute fourth difference, scaled for a normal distribution (Hampel 1974); at least the noise of the
    quantisation step, `quantum` or the smallest step seen, uniformly distributed.
    t (n_samples,) : times of the samples, strictly increasing, where they may be unevenly spaced.

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
    fourth = _fourth_difference(signal, t) if len(signal) >= len(_DIFFERENCE) else np.empty(0)
    fourth = fourth[np.isfinite(fourth)]
    white = float(np.median(np.abs(fourth)) / 0.6745) if len(fourth) else 0.0
    span, size = (float(np.ptp(signal)), float(np.abs(signal).max())) if len(signal) else (0.0, 0.0)
    return max(white, (quantum or _smallest_step(signal)) / np.sqrt(12.0), 1e-9 * span, ROUNDING * size)


def _fourth_difference(signal: Array, t: Array | None) -> Array:
    """Fourth differences with the standard deviation of one sample; divided differences (Newton) where t is uneven."""
    if t is None or np.allclose(np.diff(t), np.median(np.diff(t)), rtol=UNEVEN, atol=0.0):
        return np.convolve(signal, _DIFFERENCE, "valid") / np.sqrt(np.sum(_DIFFERENCE**2))
    n, width = len(t) - len(_DIFFERENCE) + 1, len(_DIFFERENCE)
    times = [t[i : i + n] / np.median(np.diff(t)) for i in range(width)]
    weights = [1.0 / np.prod([times[i] - times[j] for j in range(width) if j != i], axis=0) for i in range(width)]
    total = np.sum([w * signal[i : i + n] for i, w in enumerate(weights)], axis=0)
    return np.asarray(total / np.sqrt(np.sum(np.square(weights), axis=0)))


def _smallest_step(signal: Array) -> float:
    """The quantisation step where a signal takes few distinct, evenly spaced values; else 0."""
    values = np.unique(signal[np.isfinite(signal)])
    if len(values) < 3 or len(values) > 0.5 * len(signal):
        return 0.0
    steps = np.diff(values)
    quantum = float(steps[steps > 1e-12 * np.ptp(values)].min(initial=np.inf))
    whole = steps / quantum
    return quantum if np.isfinite(quantum) and np.all(np.abs(whole - np.round(whole)) < 0.05) else 0.0
