"""The white noise on a smooth signal, from its own differences."""

from __future__ import annotations

from math import comb

import numpy as np

from recordings.arrays import Array

UNEVEN = 0.01
"""Relative spread of the sampling intervals from which the difference takes the times into account."""

_NORMAL = 0.6745
"""Median absolute value of a standard normal number."""

STRETCH, LOUD = 25, 2.0
"""Differences in a stretch whose level is compared, and the factor on that of all from which it is not quiet: of white
noise alone few stretches are so loud, and what is left of it is right within 1 %. Rests of a valve that slips ten times
in a second are as short."""
FEWEST = 100
"""Differences that tell a level, at least."""


def white_noise(signal: Array, order: int, t: Array | None = None) -> float:
    """Standard deviation of the white noise on a smooth signal, in its unit; 0 where there are too few samples.

    The median absolute difference, scaled for a normal distribution (Hampel 1974). A difference removes what of the
    signal is a polynomial of a lower degree, so that what stays of a smooth signal is its noise.
    signal (n_samples,) : without gaps; order : of the difference; t (n_samples,) : times of the samples [s], strictly
    increasing, where they may be unevenly spaced.

    >>> import numpy as np
    >>> smooth = np.sin(np.linspace(0.0, 10.0, 2000))
    >>> round(white_noise(smooth + np.random.default_rng(1).normal(0.0, 0.01, 2000), order=3), 3)
    0.01
    """
    size, unit = _sizes(signal, order, t)
    return float(np.median(size)) / unit if len(size) else 0.0


def quiet_noise(signal: Array, order: int, t: Array | None = None) -> float:
    """As `white_noise`, of the quiet stretches of a signal, which may be its smaller part: a valve that slips moves for
    most of a slow recording, and differences of its motion are no noise.

    Stretches that are too loud are left out, and the rest is measured again, until none is (kappa-sigma clipping).
    """
    from scipy.ndimage import median_filter  # as much as importing this package takes, nearly

    size, unit = _sizes(signal, order, t)
    if not len(size):
        return 0.0
    size = size / unit
    level, quiet = median_filter(size, STRETCH), size
    while len(left := size[level <= LOUD * np.median(quiet)]) < len(quiet) and len(left) >= FEWEST:
        quiet = left
    return float(np.median(quiet))


def _sizes(signal: Array, order: int, t: Array | None) -> tuple[Array, float]:
    """Sizes of the known differences, and their median for white noise of one unit; none of too few samples."""
    if len(signal) <= order:
        return np.empty(0), 1.0
    difference, scale = _difference(signal, order, t)
    return np.abs(difference[np.isfinite(difference)]), _NORMAL * scale


def _difference(signal: Array, order: int, t: Array | None) -> tuple[Array, float]:
    """Differences, and their standard deviation over that of one sample; divided (Newton) where t is uneven."""
    binomial = np.array([(-1.0) ** k * comb(order, k) for k in range(order + 1)])
    scale = float(np.sqrt(np.sum(binomial**2)))
    if t is None:
        return np.diff(signal, order), scale
    if np.allclose(np.diff(t), np.median(np.diff(t)), rtol=UNEVEN, atol=0.0):
        return np.convolve(signal, binomial, "valid") / scale, 1.0
    n, width = len(t) - order, order + 1
    times = [t[i : i + n] / np.median(np.diff(t)) for i in range(width)]
    weights = [1.0 / np.prod([times[i] - times[j] for j in range(width) if j != i], axis=0) for i in range(width)]
    total = np.sum([w * signal[i : i + n] for i, w in enumerate(weights)], axis=0)
    return np.asarray(total / np.sqrt(np.sum(np.square(weights), axis=0))), 1.0
