"""Strokes: motion in one direction, from one reversal to the next."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from recordings import Array

LEAST = 0.02
"""A motion against the one before it is a stroke from this share of the whole range on."""


class Stroke(NamedTuple):
    """One stroke: samples [first, last) and its direction, 1 or -1."""

    first: int
    last: int
    direction: int


def strokes(x: Array) -> list[Stroke]:
    """The strokes of a smoothed position (n_samples,) [m], one after the other."""
    least = LEAST * float(np.quantile(x, 0.995) - np.quantile(x, 0.005))
    if not least > 0:
        return []
    turns, far, way = [0], 0, 0
    for i, value in enumerate(x.tolist()):
        beyond = value - x[far]
        if way * beyond >= 0 and way:
            far = i
        elif abs(beyond) >= least:
            turns, way = [*turns, *([far] if way else [])], 1 if beyond > 0 else -1
            far = i
    edges = [*turns, far + 1]
    return [
        Stroke(a, b, 1 if x[b - 1] > x[a] else -1)
        for a, b in itertools.pairwise(edges)
        if abs(x[b - 1] - x[a]) >= least
    ]
