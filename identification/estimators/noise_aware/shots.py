"""Runs of the model through the slips that a path misses, each under the force with which it slips as the data do.

Just below break-away a valve creeps ever faster, and an error of the force that nobody can measure decides by some
samples when it slips. About a path that slips too early or too late the linearised model finds no way to the right one.
But when a run slips hardly depends on anything else: the force, off by a constant, says when, and one number is soon
found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from identification.data.grid import Grid
from identification.estimators.estimate import OUTLIER, Innovations
from identification.estimators.noise_aware.linearised_model import BOTH, ran_along
from recordings import Array
from simulator import Kernel

APART = 0.15
"""Time [s] from which innovations that lie far off belong to slips of their own."""
BEFORE, AFTER = (0.1, 0.4), 0.1
"""Times [s] before the first innovation that lies far off at which runs begin, and after the last one to which they go:
they have to begin before the path is wrong, and near enough that no other error grows."""
OFFSETS = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
"""Offsets of the force, in its noise, of which the best is refined."""
REFINED = 8
"""Runs by which it is."""


def missed_slips(grid: Grid, line: Innovations) -> list[tuple[int, int]]:
    """The first and the last node of every group of innovations that lie far off."""
    innovations, variances = line.scored
    with np.errstate(invalid="ignore"):
        off = (np.abs(innovations) > OUTLIER * np.sqrt(variances)) & np.isfinite(variances)
    far = np.flatnonzero(off.any(axis=1))
    groups = np.split(far, np.flatnonzero(np.diff(grid.t[far]) > APART) + 1)
    return [(int(group[0]), int(group[-1])) for group in groups if len(group)]


def window(grid: Grid, slip: tuple[int, int]) -> tuple[int, int]:
    """The nodes [first, last) that runs through a slip concern."""
    begin, end = np.searchsorted(grid.t, [grid.t[slip[0]] - BEFORE[-1], grid.t[slip[1]] + AFTER])
    return int(begin), int(min(end + 1, len(grid.t)))


def shots(
    kernel: Kernel, grid: Grid, p: Array, h_max: float, path: Array, first: int, misfit: Callable[[Array], float]
) -> Iterator[Array]:  # fmt: skip
    """Paths (n, n_states) of a part of a grid that follow a given one and then, from some nodes before the first
    innovation far off, a run of the model, under the offset of the force with which the misfit is least.

    misfit : of a path, in units of the cost, infinite where the model has no solution about it.
    """

    def run(begin: int, off: float) -> Array | None:
        found, u = path.copy(), grid.force.u[begin:] + off * grid.force.noise
        own = np.ascontiguousarray(found[begin:])
        own[:, -2], own[:, -1] = u, grid.force.slope[begin:]
        if ran_along(kernel, np.ascontiguousarray(grid.t[begin:]), u, p, own, h_max, BOTH) is None:
            return None
        found[begin:] = own
        return found

    for begin in sorted({int(np.searchsorted(grid.t, grid.t[first] - before)) for before in BEFORE}):

        def misfit_of(off: float, begin: int = begin) -> float:
            found = run(begin, off)
            return np.inf if found is None else misfit(found)

        best = run(begin, best_offset(misfit_of))
        if best is not None:
            yield best


def best_offset(misfit: Callable[[float], float], offsets: Sequence[float] = OFFSETS) -> float:
    """The offset with the least misfit: the best of some, refined between its neighbours."""
    values = [misfit(off) for off in offsets]
    k = int(np.argmin(values))
    low, high = offsets[max(k - 1, 0)], offsets[min(k + 1, len(offsets) - 1)]
    refined = minimize_scalar(misfit, bounds=(low, high), method="bounded", options={"maxiter": REFINED})
    return float(refined.x) if refined.fun < values[k] else offsets[k]
