"""Stretches of a grid in which paths are compared: a path can be the best about one slip and not about the next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.data.grid import Grid
from identification.estimators.estimate import Innovations, costs
from recordings import Array, IndexArray

STRETCH = 0.5
"""Length [s] of the stretches in which paths are chosen: a slip, and the rest behind it."""


def stretchwise(stretch: IndexArray, paths: Sequence[Array], misfits: Sequence[Array]) -> Array:
    """Of some paths (n, n_states), with their misfits (n_stretches,), the best in every stretch."""
    best = np.argmin(misfits, axis=0)
    return np.ascontiguousarray(np.array(paths)[best[stretch], np.arange(len(stretch))])


def stretches(grid: Grid) -> IndexArray:
    """The number of the stretch that each node of a grid lies in, (n,)."""
    return np.asarray((grid.t - grid.t[0]) // STRETCH, int)


def stretch_costs(grid: Grid, line: Innovations) -> Array:
    """The cost of the innovations in each stretch of a grid, by which estimates are compared, (n_stretches,)."""
    return np.asarray(np.bincount(stretches(grid), costs(*line.scored)), float)
