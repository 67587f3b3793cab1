"""Segments are worked on in threads: the compiled loops hold no lock of the interpreter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
S = TypeVar("S")

WORKERS = 2
"""Threads at most."""


def each(work: Callable[[S], T], items: Sequence[S]) -> list[T]:
    """The results of some work on every item, in their order."""
    if len(items) <= 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(WORKERS) as pool:
        return list(pool.map(work, items))
