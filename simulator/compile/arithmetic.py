"""Operations that neither Python nor its `math` has with the meaning they have in C99, for translated functions."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, fabs, inf, nan
from typing import Any

import numba
import numpy as np

__all__ = ["fmax", "fmin", "remainder", "sign", "taken"]

native: Callable[[Any], Any] = numba.njit(error_model="numpy", nogil=True)


@native
def taken(condition: float, value: float) -> float:
    """The value where the condition holds, else 0, whatever the value is: one arm of an if-else."""
    return value if condition != 0.0 else 0.0


@native
def fmin(x: float, y: float) -> float:
    """The smaller one; a NaN counts as missing."""
    return x if x < y or y != y else y


@native
def fmax(x: float, y: float) -> float:
    """The larger one; a NaN counts as missing."""
    return x if x > y or y != y else y


@native
def sign(x: float) -> float:
    """-1, 1, or x itself when it is zero or NaN."""
    return -1.0 if x < 0.0 else 1.0 if x > 0.0 else x


@native
def remainder(x: float, y: float) -> float:
    """x minus the multiple of y nearest to it, the even one in a tie (IEEE 754)."""
    if x != x or y != y or fabs(x) == inf or y == 0.0:
        return nan
    size, step = np.fmod(fabs(x), 2.0 * fabs(y)), fabs(y)
    if size > 0.5 * step:
        size -= step
        if size >= 0.5 * step:
            size -= step
    return copysign(1.0, x) * size
