"""How work that takes long reports its progress."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""progress(stage, done, total): the stage in words, and how many of its parts are done; a total of 0: not known.
Called now and then, from the thread that asked for the work."""


def silent(stage: str, done: int, total: int) -> None:
    """Reports nothing: the default."""
