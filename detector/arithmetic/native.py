"""The one arithmetic of the room: numba, nothing reassociated or fused, so that equal inputs give equal bits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from detector.arithmetic.kept import KeptCode
from recordings import Array

__all__ = ["Array", "Integers", "native"]

Integers = NDArray[np.int64]


def native(function: Callable[..., Any]) -> Any:
    """Compile a function of numbers and arrays; the same function serves one sample and a whole recording."""
    dispatcher = numba.njit(error_model="numpy", nogil=True)(function)
    dispatcher._cache = KeptCode(function.__module__, function.__qualname__)
    return dispatcher
