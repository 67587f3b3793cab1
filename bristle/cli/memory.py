"""How the C library deals out memory to threads."""

from __future__ import annotations

import ctypes
import sys

M_ARENA_MAX = -8


def one_arena() -> None:
    """Have all threads share one heap, where the C library is glibc.

    With a heap each, what one thread frees no other can use: tracing takes 15 % more memory then, and is no faster.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        mallopt(M_ARENA_MAX, 1)
