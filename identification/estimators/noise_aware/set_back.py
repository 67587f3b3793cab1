"""A path of the model itself, set back to the data now and then.

The smoothed motion has every slip of the recording, blurred. Runs of the model that are set back to the data have slips
as the model has them, and follow the recording where the parameters are about right: from there the smoother arrives,
where from a blurred slip it does not.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from identification.data.grid import Grid
from identification.estimators.anchors import Anchors, anchors, deflection_at_rest, held_force
from recordings import Array
from simulator import Kernel

WINDOW = 0.25
"""A run is set back to the data once in so many seconds, where the valve rests far from break-away."""


def set_back_path(kernel: Kernel, grid: Grid, p: Array, h_max: float, first: Array, off: float = 0.0) -> Array | None:
    """The path (n, n_states) of runs of the model under the smoothed force that are set back to the smoothed motion,
    from a first path; off : what is added to the force, in its noise. None without a solution.
    """
    grid = replace(grid, force=replace(grid.force, u=grid.force.u + off * grid.force.noise))
    path = first.copy()
    path[:, -2] = grid.force.u
    known = Rests.of(kernel, grid, p)
    at, rest = known.anchors
    memory = path[at[0] if len(at) else 0, 2:-2].copy()
    since = None if grid.lead is None else _since_last_rest(kernel, grid.lead, p, path[0], h_max)
    if since is not None and (not len(at) or at[0] > 0):
        at, rest, path[0], memory = np.array([0, *at]), np.array([False, *rest]), since, since[2:-2].copy()
    for k, (begin, end) in enumerate(itertools.pairwise((*at, len(grid.t) - 1))):
        own = np.ascontiguousarray(path[begin : end + 1])
        own[0, 2:-2] = memory
        if since is None or begin > 0:
            own[0] = known.set_back(begin, own[0], at_rest=bool(rest[k]))
        if not _run(kernel, grid.part(begin, end + 1), p, own, h_max):
            return None
        path[begin : end + 1], memory = own, own[-1, 2:-2].copy()
    return path


@dataclass(frozen=True)
class Rests:
    """Where runs over a grid are set back, and what the bristle holds there. z : place of its deflection in a state."""

    grid: Grid
    anchors: Anchors
    deflection: Array
    z: int

    @classmethod
    def of(cls, kernel: Kernel, grid: Grid, p: Array) -> Rests:
        values = dict(zip(kernel.parameters, p.tolist(), strict=True))
        x, v, crept = grid.motion.T
        load = np.abs(held_force(values, grid.force.u, x)) / values["lugre.fs"]
        at = anchors(grid.t, crept, np.gradient(v, grid.t), WINDOW, load=load)
        return cls(grid, at, deflection_at_rest(values, grid.force.u, x), kernel.states.index("lugre.z"))

    def set_back(self, node: int, state: Array, *, at_rest: bool) -> Array:
        """A state (n_states,) with position and velocity of the data at a node, and at rest the deflection."""
        found, (x, v, _) = state.copy(), self.grid.motion[node]
        found[:2] = x, 0.0 if at_rest else v
        if at_rest:
            found[self.z] = self.deflection[node]
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
    own[0] = known.set_back(begin, own[0], at_rest=True)
    return own[-1].copy() if _run(kernel, tail, p, own, h_max) else None


def _run(kernel: Kernel, grid: Grid, p: Array, path: Array, h_max: float) -> bool:
    """Run the model along a path (n, n_states) from its first state, and write it there; whether it has a solution."""
    run = kernel.shoot(grid.t, grid.force.u, p, path, h_max=h_max, carry="motion and memory")
    return run.failed is None and bool(np.isfinite(path).all())
