"""The one arithmetic of the room: numba, nothing reassociated or fused, so that equal inputs give equal bits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Integers", "native"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

native: Callable[[Any], Any] = numba.njit(error_model="numpy", nogil=True)
"""Compile a function of numbers and arrays; the same function serves one sample and a whole recording."""
