"""The grid of a segment whose motion is imposed: what drives the model, which samples count, and with what error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.data.close_motion import closely_imposed, disturbed, thinned
from identification.data.experiment import Experiment, Segment
from identification.data.force import Force
from identification.data.grid import Grid
from recordings import Array, IndexArray
from simulator import Catalogue, Kernel, Site, shows_imposed

DRAWS = 8
"""Draws of the position's noise."""
BLOCK = 1.0
"""Length of the blocks whose errors share a part [s]."""


@dataclass(frozen=True, kw_only=True)
class ImposedGrid(Grid):
    """A segment with its motion imposed. driven (n, 4) : x, v, a and load; counts (n,) : the samples that are judged;
    force : as recorded, its std that of the residual of a complete model within a block; block (n,) : the number of
    each sample's block of time; shared (n_blocks,) [N] : standard deviation of what all errors of a block share, for
    a bristle that stopped elsewhere stays there.
    """

    driven: Array
    counts: NDArray[np.bool_]
    block: IndexArray
    shared: Array

    def driven_along(self, path: Array) -> Array:
        """`driven`, whatever the path is."""
        return self.driven

    @property
    def floor(self) -> float:
        """Root mean square of a complete model's residual [N]."""
        return float(np.sqrt(np.mean(self.force.std**2) + np.mean(self.shared**2)))

    def apart(self, errors: Array) -> Array:
        """Errors (n, m) [N] without what those of a block share, so that `force.std` is the spread of each alone."""
        errors = np.where(self.counts[:, None], errors, 0.0)
        weight = np.where(self.counts, self.force.std**-2, 0.0)
        size = np.bincount(self.block, weight)
        share = (1.0 - 1.0 / np.sqrt(1.0 + self.shared**2 * size)) / np.maximum(size, 1e-300)
        sums = np.column_stack([np.bincount(self.block, weight * column) for column in errors.T])
        return np.where(self.counts[:, None], errors - (share[:, None] * sums)[self.block], 0.0)


def imposed_grids(experiments: Sequence[Experiment], kernel: Kernel, p: Array) -> list[Grid]:
    """The grids of experiments; a complete model's residual is the noise of the force, and what the position's noise
    and the motion between samples do to the force that a model with parameters p predicts. What comes before memory
    has forgotten where it started does not count.
    """
    return [grid for e in experiments for grid in _grids(e, kernel, p)]


def showing(experiments: Sequence[Experiment], catalogue: Catalogue) -> tuple[str, ...]:
    """The effects of a catalogue that can show in a predicted force.

    Those on the input need a load beside it: where the load is all of the force, what they do to it cannot be told from
    what they do to its noise.
    """
    apart = all(e.causality == "motion" and any(np.ptp(s.load) > 0 for s in e.segments) for e in experiments)
    return tuple(e.id for e in catalogue.effects if shows_imposed(e) and (apart or e.site is Site.FORCE))


def _grids(e: Experiment, kernel: Kernel, p: Array) -> Iterator[ImposedGrid]:
    close, held = closely_imposed(e), dict(zip(kernel.parameters, p, strict=True))
    plain, limit = _predictions(close, kernel, p), held["lugre.fc"] / held["lugre.sigma0"]
    others = [_predictions(one, kernel, p) for one in (*disturbed(e, DRAWS, np.random.default_rng(0)), thinned(e))]
    ends = [_predictions(close, kernel, p, z) for z in (-limit, limit)]  # deflections that a motion may leave behind
    for i, s in enumerate(close.segments):
        errors = np.nan_to_num(np.stack([one[i] for one in others]) - plain[i])
        block = np.floor((s.t - s.t[0]) / BLOCK).astype(int)
        shared = np.stack([np.bincount(block, one) for one in errors]) / np.bincount(block)
        weights = np.append(np.full(DRAWS, 1.0 / DRAWS), 1.0)
        std = float(np.sqrt(e.noise_force**2 + weights @ np.mean((errors - shared[:, block]) ** 2, axis=1)))
        between = weights @ shared**2
        unknown = np.flatnonzero(np.abs(ends[1][i] - ends[0][i]) > std)
        counts = s.seen & (np.arange(len(s.t)) > (unknown[-1] if len(unknown) else -1))
        n, m = len(s.t), s.motion
        yield ImposedGrid(
            s.t, s.y, s.u, Force(s.u, np.zeros(n), np.full(n, std), np.zeros(n - 1), e.noise_force, 0.0),
            e.noise_position, np.column_stack([m.x, m.v, m.crept]), driven=_driven(s), counts=counts, block=block,
            shared=np.sqrt((between + between.mean()) / 2),
        )  # fmt: skip


def _predictions(e: Experiment, kernel: Kernel, p: Array, deflection: float = 0.0) -> list[Array]:
    """The forces (n,) [N] that a model predicts. deflection : of its bristles at first [m]."""
    found = []
    for s in e.segments:
        start = first_state(kernel, _driven(s))
        start[kernel.states.index("lugre.z")] = deflection
        found.append(kernel.run(s.t, _driven(s), p, start).outputs[:, 0])
    return found


def _driven(s: Segment) -> Array:
    return np.column_stack([s.motion.x, s.motion.v, s.motion.a, s.load])


def first_state(kernel: Kernel, driven: Array) -> Array:
    """The state (n_states,) at the beginning of a motion (n, 4): x, v, a and load."""
    return kernel.start(driven[0, 0], 0.0, driven[0, 3])
