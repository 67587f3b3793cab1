"""Segments are worked on in threads: the compiled loops hold no lock of the interpreter."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")
S = TypeVar("S")

WORKERS = 2
"""Threads at most."""

_ALONE = ContextVar("alone", default=False)

NAME = "segment"
"""What the names of the threads begin with."""


def each(work: Callable[[S], T], items: Sequence[S]) -> list[T]:
    """The results of some work on every item, in their order; all of it has ended when the first error is raised.

    Work that asks for the same is done by its own thread: all others may be waiting for it.
    """
    if len(items) <= 1 or _ALONE.get() or threading.current_thread().name.startswith(NAME):
        return [work(item) for item in items]
    pool = _pool(os.getpid())
    futures = [pool.submit(work, item) for item in items]
    try:
        wait(futures)
    finally:  # what has not begun is of no use to anybody after an interrupt
        for future in futures:
            future.cancel()
    return [future.result() for future in futures]


@contextmanager
def one_thread() -> Iterator[None]:
    """Inside, the thread that entered does all its work itself: other cores have valves of their own."""
    token = _ALONE.set(True)
    try:
        yield
    finally:
        _ALONE.reset(token)


@functools.cache
def _pool(process: int) -> ThreadPoolExecutor:
    """The threads of a process, kept: an identification asks for them thousands of times. A forked one has none yet."""
    return ThreadPoolExecutor(WORKERS, NAME)
