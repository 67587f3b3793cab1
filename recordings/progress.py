"""How long work says how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""progress(stage, done, total): what is being done, in words, and how many of how many parts of it are done; a total of
0 says that nobody knows. Called now and then, from the thread that asked for the work."""


def silent(stage: str, done: int, total: int) -> None:
    """Progress that nobody watches."""
