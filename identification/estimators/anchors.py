"""Where a free run is set back to the data: rests that are far from break-away.

Stick-slip forgets its phase over minutes, and what one slip does says more of friction than when the hundredth
happened. So a run is set back to the smoothed motion now and then. Near break-away that would be fatal: a valve creeps
there, and one that is set back at rest, or a few micrometres beside, slips at once. A rest soon after a slip is safe,
and there the deflection of the bristle follows from the balance of forces.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from recordings import Array, IndexArray

SHORT = 0.05
"""Window [s] below which a free run is set back at even times: it holds no rest, and no slip."""
SAFE = 0.8
"""Share of the break-away force that friction holds at most where a run is set back at rest."""


class Anchors(NamedTuple):
    """Where a run is set back. at (n_anchors,): the samples; rest (n_anchors,) : whether the valve rests there."""

    at: IndexArray
    rest: NDArray[np.bool_]


def anchors(
    t: Array, crept: Array, a: Array, window: float, spacing: float = 0.0, load: Array | None = None
) -> Anchors:
    """The samples, one in every window at most, at which a free run is set back to the data.

    t (n_samples,) [s]; crept (n_samples,) [m/s]: velocity behind a dead zone, 0 at rest; a (n_samples,) [m/s2]:
    acceleration; window, spacing [s]: of the samples; load (n_samples,): what friction holds, as a share of the
    break-away force, if known.

    A window in which the valve rests has its anchor where the load is least, and none where that is above `SAFE`;
    without a load it is in the middle of the rest. A window without a rest has it at the least acceleration. One below
    `SHORT` follows the data wherever it begins.
    """
    step = max(window, spacing)
    edges = np.unique(np.searchsorted(t, np.arange(0.0, t[-1] + step, step)))
    still = crept == 0.0
    if window < SHORT:
        return Anchors(edges[:-1], np.zeros(len(edges) - 1, bool))
    at, rest = list[int](), list[bool]()
    for first, last in itertools.pairwise(edges):
        resting = first + np.flatnonzero(still[first:last])
        if not len(resting):
            at.append(first + int(np.argmin(np.abs(a[first:last]))))
        elif load is None:
            at.append(int(resting[len(resting) // 2]))
        else:
            least = int(resting[np.argmin(load[resting])])
            if load[least] > SAFE:
                continue
            at.append(least)
        rest.append(bool(still[at[-1]]))
    return Anchors(np.array(at, int), np.array(rest, bool))


def held_force(values: Mapping[str, float], u: Array, x: Array) -> Array:
    """The force [N] that friction holds at rest, for parameters by full name, a force u [N] and a position x [m]."""
    return np.asarray(u - values["spring.K"] * x - values["spring.F0"], float)


def deflection_at_rest(values: Mapping[str, float], u: Array, x: Array) -> Array:
    """The deflection of the bristle [m] that balances the forces at rest."""
    most = values["lugre.fs"]
    return np.clip(held_force(values, u, x), -most, most) / values["lugre.sigma0"]
