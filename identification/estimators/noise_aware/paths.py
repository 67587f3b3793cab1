"""Paths about which the model is linearised where a slip lasts a few samples: new ones, and others beside one.

About a path that slips a sample early or late the model is linear somewhere else, and no small step leads to the right
slip. So there are several to choose from, and what each explains is known stretch by stretch.
"""

from __future__ import annotations

import numpy as np

from identification.data.grid import Grid
from identification.estimators.anchors import deflection_at_rest
from identification.estimators.noise_aware.linearised_model import first_path, ran_along
from identification.estimators.noise_aware.set_back import set_back_path
from recordings import Array
from simulator import Kernel

SLOW = 0.5
"""Share of the Stribeck velocity below which the stem creeps."""


def first_paths(kernel: Kernel, grid: Grid, p: Array, h_max: float) -> list[Array | None]:
    """New paths (n, n_states) of a grid at parameters p: along the smoothed motion, and a run of the model. None in the
    place of one without a solution.
    """
    first = first_path(kernel, grid, p)
    if first is None:
        return []
    return [balanced(kernel, grid, p, first), set_back_path(kernel, grid, p, h_max, first)]


def balanced(kernel: Kernel, grid: Grid, p: Array, first: Array) -> Array:
    """A first path (n, n_states) on which the bristle balances the forces wherever the stem creeps or rests.

    A valve whose controller integrates creeps for seconds just below break-away. No run of the model stays there: an
    error of the force that nobody can measure makes it slip, and its bristle slides off. The balance knows better.
    """
    path = first.copy()
    values = dict(zip(kernel.parameters, p.tolist(), strict=True))
    v = grid.motion[:, 1]
    slow = np.abs(v) < SLOW * values["lugre.vs"]
    held = deflection_at_rest(values, grid.force.u - values["lugre.sigma2"] * v, path[:, 0])
    z = kernel.states.index("lugre.z")
    path[:, 1], path[:, z] = v, np.where(slow, held, path[:, z])
    return path


def along_smooth_motion(kernel: Kernel, grid: Grid, p: Array, path: Array) -> Array | None:
    """A path (n, n_states) with the velocity of the smoothed motion instead, and memory that runs along it. None
    without a solution.
    """
    found = path.copy()
    found[:, 1] = grid.motion[:, 1]
    return None if ran_along(kernel, grid.t, np.ascontiguousarray(path[:, -2]), p, found) is None else found


def without_overshoot(kernel: Kernel, grid: Grid, p: Array, path: Array) -> Array:
    """A path (n, n_states) whose velocity and memory are medians of three nodes: where a valve breaks away, a step to
    the smoothed path can go too far at one node, and back at the next, and then it does so for good.
    """
    found = path.copy()
    found[1:-1, 1:-2] = np.median([path[:-2, 1:-2], path[1:-1, 1:-2], path[2:, 1:-2]], axis=0)
    return found
