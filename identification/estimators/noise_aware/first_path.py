"""Paths about which a model is linearised first.

Two are at hand. The smoothed motion follows every slip of the recording, blurred, and the memory of the effects runs
along it. Runs of the model itself that are set back to the data have slips as the model has them, and follow the
recording where the parameters are about right: from there the smoother arrives, where from a blurred slip it does not.
"""

from __future__ import annotations

import itertools

import numpy as np

from identification.data.grid import Grid
from identification.estimators.anchors import anchors, deflection_at_rest, held_force
from recordings import Array
from simulator import Kernel

WINDOW = 0.25
"""A run is set back to the data once in so many seconds, where the valve rests far from break-away."""


def first_path(kernel: Kernel, grid: Grid, p: Array, h_max: float = 1e-3) -> Array | None:
    """A path (n, n_states) along the smoothed motion and force, on which the memory of the effects has run along: that
    of a part since before it began, for plays remember turns that are long past.
    """
    value = dict(zip(kernel.parameters, p, strict=True))
    start = kernel.start(grid.motion[0, 0], 0.0, grid.force.u[0])
    path = np.zeros((len(grid.t), len(kernel.states)))
    path[:, : len(start)] = start
    path[:, 0] = grid.motion[:, 0]
    path[:, 1] = grid.motion[:, 2]  # noise on v would relax the bristle, and linearise rest as motion
    path[:, -2], path[:, -1] = grid.force.u, grid.force.slope
    deflection = value["lugre.fc"] / value["lugre.sigma0"]
    held = grid.force.u[0] - value["spring.K"] * path[0, 0] - value["spring.F0"]
    path[0, kernel.states.index("lugre.z")] = np.clip(held / value["lugre.sigma0"], -deflection, deflection)
    before = None if grid.lead is None else first_path(kernel, grid.lead, p, h_max)
    if before is not None:
        path[0, 2:-2] = before[-1, 2:-2]
    run = kernel.shoot(grid.t, grid.force.u, p, path, h_max=h_max, carry="memory")
    return None if run.failed is not None or not np.isfinite(path).all() else path


def set_back_path(kernel: Kernel, grid: Grid, p: Array, h_max: float) -> Array | None:
    """The path (n, n_states) of runs of the model under the smoothed force that are set back to the smoothed motion,
    from a first path. None without a solution.
    """
    path = first_path(kernel, grid, p)
    if path is None:
        return None
    values = dict(zip(kernel.parameters, p.tolist(), strict=True))
    x, v, crept = grid.motion.T
    load = np.abs(held_force(values, grid.force.u, x)) / values["lugre.fs"]
    at, rest = anchors(grid.t, crept, np.gradient(v, grid.t), WINDOW, load)
    z = kernel.states.index("lugre.z")
    deflection = deflection_at_rest(values, grid.force.u, x)
    memory = path[at[0] if len(at) else 0, 2:-2].copy()
    for k, (first, last) in enumerate(itertools.pairwise((*at, len(grid.t) - 1))):
        part = slice(first, last + 1)
        own = np.ascontiguousarray(path[part])
        own[0, 2:-2] = memory
        own[0, :2] = x[first], 0.0 if rest[k] else v[first]
        if rest[k]:
            own[0, z] = deflection[first]
        run = kernel.shoot(grid.t[part], grid.force.u[part], p, own, h_max=h_max, carry="motion and memory")
        if run.failed is not None or not np.isfinite(own).all():
            return None
        path[part], memory = own, own[-1, 2:-2].copy()
    return path
