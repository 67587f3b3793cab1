"""How long a residual remembers."""

from __future__ import annotations

import numpy as np

from recordings import Array

_NOT_COUNTED = 0.15
_WINDOW = 5.0
"""Sokal's window: lags up to so many correlation times are summed."""

_MOST_SAMPLES = 1_000_000


def correlation_time(row: Array) -> float:
    """Integrated correlation time of a row (n_samples,) in samples, 0.5 for an independent one (Sokal 1989).

    Correlations below 0.15 are not counted: a short record cannot tell them from none. Of an oscillation the largest
    partial sum counts, not what it comes to when the waves cancel.
    """
    about = row[:_MOST_SAMPLES] - np.mean(row[:_MOST_SAMPLES])
    power = float(about @ about)
    if power <= 0:
        return 0.5
    size = 1 << (2 * len(about) - 1).bit_length()
    correlation = np.fft.irfft(np.abs(np.fft.rfft(about, size)) ** 2, size)[: len(about)] / power
    counted = np.where(np.abs(correlation[1:]) > _NOT_COUNTED, correlation[1:], 0.0)
    summed = 0.5 + np.maximum.accumulate(np.maximum(np.cumsum(counted), 0.0))
    beyond = np.flatnonzero(np.arange(1, len(about)) >= _WINDOW * summed)
    return float(summed[beyond[0]] if len(beyond) else summed[-1])
