"""A path of the model itself, set back to the data now and then.

The smoothed motion has every slip of the recording, blurred. Runs of the model that are set back to the data have slips
as the model has them, and follow the recording where the parameters are about right: from there the smoother arrives,
where from a blurred slip it does not.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.data.grid import Grid
from identification.estimators.anchors import Anchors, anchors, deflection_at_rest, held_force
from identification.estimators.noise_aware.linearised_model import BOTH, ran_along
from recordings import Array
from simulator import Kernel

WINDOW = 0.25
"""A run is set back to the data once in so many seconds, where the valve rests far from break-away."""


def set_back_path(kernel: Kernel, grid: Grid, p: Array, h_max: float, first: Array) -> Array | None:
    """The path (n, n_states) of a run of the model under the smoothed force that is set back to the smoothed motion,
    from a first path. None without a solution.
    """
    since = None if grid.lead is None else _since_last_rest(kernel, grid.lead.grid, p, first[0], h_max)
    path = first.copy()
    path[:, -2] = grid.force.u
    known = Rests.of(kernel, grid, p)
    at, rest = known.anchors
    start = at[0] if len(at) else 0
    state, apart = path[start], path[start, 0] - grid.motion[start, 0]
    if since is not None and (not len(at) or at[0] > 0):
        at, rest, state = np.array([0, *at]), np.array([False, *rest]), since
    for k, (begin, end) in enumerate(itertools.pairwise((*at, len(grid.t) - 1))):
        own = np.ascontiguousarray(path[begin : end + 1])
        own[0, :-2] = state[:-2]
        if since is None or begin > 0:
            own[0] = known.set_back(begin, own[0], apart, at_rest=bool(rest[k]))
        u = grid.force.u[begin : end + 1]
        read = ran_along(kernel, np.ascontiguousarray(grid.t[begin : end + 1]), u, p, own, h_max, BOTH)
        if read is None:
            return None
        path[begin : end + 1], state, apart = own, own[-1].copy(), own[-1, 0] - read[-1]
    return path


@dataclass(frozen=True)
class Rests:
    """Where runs over a grid are set back. values : parameters by full name; z, carried : places in a state of the
    deflection of the bristle, and of the memory that begins at the position.
    """

    grid: Grid
    values: Mapping[str, float]
    anchors: Anchors
    z: int
    carried: list[int]

    @classmethod
    def of(cls, kernel: Kernel, grid: Grid, p: Array) -> Rests:
        values = dict(zip(kernel.parameters, p.tolist(), strict=True))
        x, v, crept = grid.motion.T
        load = np.abs(held_force(values, grid.force.u, x)) / values["lugre.fs"]
        at = anchors(grid.t, crept, np.gradient(v, grid.t), WINDOW, load=load)
        carried = [i for i, m in enumerate(kernel.layout.memory, 2) if m.at_position]
        return cls(grid, values, at, kernel.states.index("lugre.z"), carried)

    def set_back(self, node: int, state: Array, apart: float, *, at_rest: bool) -> Array:
        """A state (n_states,) with position and velocity of the data at a node, and at rest the deflection.

        apart : of the stem from what is read [m]. Memory that begins at the position keeps its distance from it.
        """
        found, (x, v, _) = state.copy(), self.grid.motion[node]
        found[:2] = x + apart, 0.0 if at_rest else v
        for i in self.carried:
            found[i] += found[0] - state[0]
        if at_rest:
            found[self.z] = deflection_at_rest(self.values, self.grid.force.u[node], found[0])
        return found


def _since_last_rest(kernel: Kernel, lead: Grid, p: Array, state: Array, h_max: float) -> Array | None:
    """The state (n_states,) at the end of a lead, of a run from the last rest in it that is far from break-away: a
    stretch that begins in a slip, or near one, has nothing to be set back to. None where there is none.

    state : at the end of the lead, as far as it is known.
    """
    if len(lead.t) < 3:
        return None
    known = Rests.of(kernel, lead, p)
    rests = known.anchors.at[known.anchors.rest]
    if not len(rests) or rests[-1] == len(lead.t) - 1:
        return None
    begin = int(rests[-1])
    tail = lead.part(begin, len(lead.t))
    own = np.tile(state, (len(tail.t), 1))
    own[:, -2], own[:, -1] = tail.force.u, tail.force.slope
    own[0] = known.set_back(begin, own[0], state[0] - lead.motion[-1, 0], at_rest=True)
    return None if ran_along(kernel, tail.t, tail.force.u, p, own, h_max, BOTH) is None else own[-1].copy()
