"""The grid of a segment: the nodes on which the path of a model is estimated, and what is known there before any model.

A grid has a node at every sample, and further ones where samples are far apart.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.answer import answering
from identification.data.experiment import Experiment, Segment
from identification.data.force import Force, estimate_force, smoother_force
from identification.parallel import each
from recordings import Array

WIDEST_NODES = 5e-3
"""Longest time between nodes of a path [s]: between slow samples the force can do more than move at one slope."""


@dataclass(frozen=True)
class Grid:
    """A segment on the nodes of its path. t (n,) [s]; y (n,) [m] and u (n,) [N] measured, NaN at nodes between
    samples; force : what the recording alone says of it; noise_y [m]; motion (n, 3): smoothed x [m] and v [m/s], and v
    behind a dead zone at the level of the noise; lead : of a part, what comes before it.
    """

    t: Array
    y: Array
    u: Array
    force: Force
    noise_y: float
    motion: Array
    lead: Lead | None = None

    @classmethod
    def of(cls, segment: Segment, noise_y: float, noise_u: float) -> Grid:
        """The grid of a segment with the noise of its channels, standard deviations noise_y [m] and noise_u [N]."""
        force = answering(segment.t, segment.u, estimate_force(segment.t, segment.u, noise_u), segment.motion)
        y = np.where(segment.seen, segment.y, np.nan)
        motion = np.column_stack([segment.motion.x, segment.motion.v, segment.motion.crept])
        grid = cls(np.ascontiguousarray(segment.t), y, segment.u, force, noise_y, motion)
        return grid.divided(int(np.ceil(segment.dt / WIDEST_NODES - 1e-9)))

    @functools.cached_property
    def free_force(self) -> Array:
        """The force (n,) [N] for free runs of the whole: smoothed as is likeliest."""
        seen = np.isfinite(self.u)
        found = smoother_force(self.t[seen], self.u[seen], self.force)
        return self.force.u if found is None else np.interp(self.t, self.t[seen], found)

    @functools.cached_property
    def latest_path(self) -> dict[str, tuple[object, bytes, Array | None]]:
        """The latest path along the smoothed motion, with its kernel and parameters: all parts begin on it. The only
        item, "path", is replaced as a whole, since threads share it.
        """
        return {}

    def with_local_smoothing(self) -> Grid:
        """The same grid with position and velocity of its motion smoothed as the force is: over a second where little
        happens, so that a creep shows, and hardly where the valve slips.
        """
        seen = np.isfinite(self.y)
        found = estimate_force(self.t[seen], self.y[seen], self.noise_y)
        x, v = (np.interp(self.t, self.t[seen], z) for z in (found.u, found.slope))
        return replace(self, motion=np.column_stack([x, v, self.motion[:, 2]]))

    def driven_along(self, path: Array) -> Array:
        """What drives a model whose motion is imposed as on a path (n, n_states): x [m], v [m/s], a [m/s2] and the
        load [N], (n, 4).
        """
        return np.column_stack([path[:, 0], path[:, 1], np.gradient(path[:, 1], self.t), path[:, -2]])

    def part(self, first: int, last: int) -> Grid:
        """The nodes [first, last)."""
        f, s = self.force, slice(first, last)
        force = Force(f.u[s], f.slope[s], f.std[s], f.intensity[first : last - 1], f.noise, f.likelihood)
        t, motion = np.ascontiguousarray(self.t[s]), np.ascontiguousarray(self.motion[s])
        lead = Lead(self, first) if first else self.lead
        return Grid(t, self.y[s], self.u[s], force, self.noise_y, motion, lead)

    def divided(self, between: int) -> Grid:
        """The same grid with every interval divided in so many."""
        if between <= 1:
            return self
        n = len(self.t)
        t = np.interp(np.arange((n - 1) * between + 1) / between, np.arange(n), self.t)

        def spread(values: Array) -> Array:
            wide = np.full(len(t), np.nan)
            wide[::between] = values
            return wide

        f = self.force
        force = replace(
            f, u=np.interp(t, self.t, f.u), slope=np.interp(t, self.t, f.slope), std=np.interp(t, self.t, f.std),
            intensity=np.repeat(f.intensity, between),
        )  # fmt: skip
        motion = np.column_stack([np.interp(t, self.t, column) for column in self.motion.T])
        return Grid(t, spread(self.y), spread(self.u), force, self.noise_y, motion, self.lead)


@dataclass(frozen=True)
class Lead:
    """What comes before a part of a grid. whole : the grid; first : its node at which the part begins."""

    whole: Grid
    first: int

    @functools.cached_property
    def grid(self) -> Grid:
        """The nodes up to the first one of the part."""
        return self.whole.part(0, self.first + 1)


def grids(experiments: Sequence[Experiment]) -> list[Grid]:
    """The grids of all segments of some experiments."""
    pairs = [(s, e) for e in experiments for s in e.segments]
    return each(lambda pair: Grid.of(pair[0], pair[1].noise_position, pair[1].noise_force), pairs)


def with_smooth_force(experiments: Sequence[Experiment], known: Sequence[Grid] | None = None) -> list[Experiment]:
    """The experiments with their force smoothed, for free runs; known : their grids, where they are at hand."""
    rest = iter(grids(experiments) if known is None else known)
    found = []
    for e in experiments:
        pairs = [(s, next(rest)) for s in e.segments]
        smooth = [replace(s, u=np.interp(s.t, grid.t, grid.free_force)) for s, grid in pairs]
        found.append(e.with_segments(tuple(smooth)))
    return found
