"""Chunks of long recordings: enough to search on, in a fraction of the time. The one place where recordings are cut.

Every function gives slices of ``range(n)``; what is cut (segments, grids, paths) is cut by its own ``part``.
"""

from __future__ import annotations

import numpy as np


def to_the_ends(n: int, length: int, count: int) -> list[slice]:
    """So many chunks of a length, evenly spread, the first at the beginning and the last at the end of n samples."""
    return [slice(int(first), int(first) + length) for first in np.linspace(0, n - length, count).astype(int)]


def centred(n: int, length: int, count: int) -> list[slice]:
    """So many chunks of a length, each in the middle of its share of n samples."""
    firsts = (int(np.clip((i + 0.5) / count * n - length / 2, 0, max(n - length, 0))) for i in range(count))
    return [slice(first, min(n, first + length)) for first in firsts]


def regular(n: int, length: int, distance: int) -> list[slice]:
    """Chunks of a length, one after every distance, as many as n samples hold."""
    return [slice(first, first + length) for first in range(0, n - length, distance)]
