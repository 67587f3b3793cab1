"""How work that takes long reports its progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")

Progress = Callable[[str, int, int], None]
"""progress(stage, done, total): the stage in words, and how many of its parts are done; a total of 0: not known.
Called now and then, from the thread that asked for the work."""


def silent(stage: str, done: int, total: int) -> None:
    """Reports nothing: the default."""


def tracked(items: Sequence[T], stage: str, progress: Progress) -> Iterator[T]:
    """The items one by one, with progress before the first and after each."""
    progress(stage, 0, len(items))
    for done, item in enumerate(items, 1):
        yield item
        progress(stage, done, len(items))
