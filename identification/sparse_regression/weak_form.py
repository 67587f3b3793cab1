"""The weak form of a regression: means over smooth windows instead of values at samples (Messenger, Bortz, MMS 19(3),
2021).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from recordings import Array

WINDOW = 0.04
"""Width of the test functions [s], at least 4 samples."""


def samples_of_window(dt: float) -> int:
    """Width of a window in samples that are dt [s] apart, even."""
    return max(4, round(WINDOW / dt)) // 2 * 2


def window(dt: float) -> Array:
    """The test function, a Hann window (n,) whose sum is 1."""
    test = np.hanning(samples_of_window(dt) + 1)
    return np.asarray(test / test.sum(), float)


def weak(table: Array, sure: NDArray[np.bool_], dt: float) -> Array:
    """Means of columns (n_samples, n) over Hann windows that overlap by half: the weak form, in which white noise
    averages out. Windows with a sample that is not sure are left out.
    """
    test, half = window(dt), samples_of_window(dt) // 2
    if len(table) < len(test):
        return np.empty((0, table.shape[1]))
    whole = np.convolve(np.where(sure, 1.0, 0.0), test, "valid")[::half] > 1 - 1e-9
    means = [np.convolve(column, test, "valid")[::half] for column in table.T]
    return np.column_stack(means)[whole]
