"""The one arithmetic of the room: numba, nothing reassociated or fused, so that equal inputs give equal bits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

from detector.arithmetic.machine_code_cache import MachineCodeCache
from recordings import Array, Integers

__all__ = ["Array", "Integers", "native"]


def native(function: Callable[..., Any]) -> Any:
    """Compile a function of numbers and arrays; the same function serves one sample and a whole recording."""
    return _compiled(function, numba.njit(error_model="numpy", nogil=True)(function))


def inlined(function: Callable[..., Any]) -> Any:
    """As `native`, for a part of a loop's body: its code is put where it is called, which a call would slow down."""
    return _compiled(function, numba.njit(error_model="numpy", nogil=True, forceinline=True)(function))


def _compiled(function: Callable[..., Any], dispatcher: Any) -> Any:
    dispatcher._cache = MachineCodeCache(function.__module__, function.__qualname__)
    return dispatcher
