"""Whether samples and nodes are close enough to see a break-away, in which the mass swings on its bristles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.order import swing, turn
from recordings import Array

SWING, MOST_BETWEEN = 0.75, 2
"""Radians of a swing between nodes, and nodes per sample that are spent on it at most."""


RESOLVED_BY_NODES = SWING * MOST_BETWEEN
"""Radians of a swing between samples that so many nodes resolve."""


def resolved_by_nodes(values: Mapping[str, float], spacing: float) -> bool:
    """Whether nodes between samples `spacing` [s] apart resolve the swing of parameters by full name."""
    return turn(values, spacing) < RESOLVED_BY_NODES


def quickest(coordinates: Coordinates, starts: Sequence[Array]) -> float:
    """The largest `swing` [rad/s] of several starts (m,): one of them may have a mass of tons."""
    return max(swing(coordinates.values(theta)) for theta in starts)


def resolving(segment_grids: Sequence[Grid], omega: float) -> list[Grid]:
    """Grids with nodes close enough for a swing of omega [rad/s], within reason.

    Between nodes a break-away is linearised as a whole: where the mass swings on its bristles by more than a radian in
    that time, paths do not settle.
    """

    def between(grid: Grid) -> int:
        spacing = float(np.median(np.diff(grid.t)))
        return int(np.clip(np.ceil(omega * spacing / SWING), 1, MOST_BETWEEN))

    return [grid.divided(between(grid)) for grid in segment_grids]
