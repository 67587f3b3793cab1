"""The grid of a segment whose motion is imposed: what drives the model, which samples count, and with what error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

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
    force : as recorded, its std what the residual of a complete model weighs, beside what the errors of a block
    share: their standard deviation, for a slip leaves more than a rest, or evened out (`beside`); block (n,) : the
    number of each sample's block of time; shared (n_blocks,) [N] : standard deviation of what all errors of a block
    share, for a bristle that stopped elsewhere stays there.
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

    def beside(self, missed: float) -> ImposedGrid:
        """The same grid for a model that misses a force of such a mean square [N2] throughout: the larger that is, the
        more alike the blocks weigh. The mean of the variances stays, so a complete model leaves a loss of 1 at most.
        """
        own = self.force.std**2
        mean = float(np.mean(own[self.counts] if self.counts.any() else own))
        std = np.sqrt((own + missed) * mean / (mean + missed))
        return replace(self, force=replace(self.force, std=std))

    def apart(self, errors: Array) -> Array:
        """Errors (n, m) [N] without what those of a block share, so that `force.std` is the spread of each alone."""
        errors = np.where(self.counts[:, None], errors, 0.0)
        weight = np.where(self.counts, self.force.std**-2, 0.0)
        size = np.bincount(self.block, weight)
        share = (1.0 - 1.0 / np.sqrt(1.0 + self.shared**2 * size)) / np.maximum(size, 1e-300)
        sums = np.column_stack([np.bincount(self.block, weight * column) for column in errors.T])
        return np.where(self.counts[:, None], errors - (share[:, None] * sums)[self.block], 0.0)


def imposed_grids(experiments: Sequence[Experiment], kernel: Kernel, p: Array) -> list[ImposedGrid]:
    """The grids of experiments; a complete model's residual is the noise of the force, and what the position's noise
    and the motion between samples do to the force that a model with parameters p predicts. What comes before memory
    has forgotten where it started does not count.
    """
    return [grid for e in experiments for grid in _grids(e, kernel, p)]


def missed_square(grids: Sequence[ImposedGrid], kernel: Kernel, p: Array) -> float:
    """The mean square of the force that a model with parameters p misses throughout [N2]: the median, over blocks, of
    what their mean square exceeds that of a complete model by; 0 where it does not. A variance component (after
    DerSimonian and Laird, Controlled Clinical Trials 7(3), 1986). Where a bristle has stopped elsewhere nothing is
    missing, and that is in some blocks only, so it is the median.
    """
    runs = [kernel.run(grid.t, grid.driven, p, first_state(kernel, grid.driven)) for grid in grids]
    excess = np.concatenate([_excess(grid, run.outputs[:, 0]) for grid, run in zip(grids, runs, strict=True)])
    return max(0.0, float(np.median(excess))) if len(excess) else 0.0


def _excess(grid: ImposedGrid, predicted: Array) -> Array:
    """By how much the mean square of the errors of each block exceeds that of a complete model [N2], of blocks of which
    at least half as many samples count as of the fullest.
    """
    counts = np.bincount(grid.block, grid.counts)
    square = np.bincount(grid.block, np.where(grid.counts, (grid.u - predicted) ** 2 - grid.force.std**2, 0.0))
    full = (counts > 0) & (2 * counts >= counts.max())
    return np.asarray(square[full] / counts[full] - grid.shared[full] ** 2, float)


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
        alone = np.bincount(block, weights @ (errors - shared[:, block]) ** 2) / np.bincount(block)
        std = np.sqrt(e.noise_force**2 + alone[block])
        unknown = np.flatnonzero(np.abs(ends[1][i] - ends[0][i]) > np.sqrt(np.mean(std**2)))
        counts = s.seen & (np.arange(len(s.t)) > (unknown[-1] if len(unknown) else -1))
        n, m = len(s.t), s.motion
        yield ImposedGrid(
            s.t, s.y, s.u, Force(s.u, np.zeros(n), std, np.zeros(n - 1), e.noise_force, 0.0),
            e.noise_position, np.column_stack([m.x, m.v, m.crept]), driven=_driven(s), counts=counts, block=block,
            shared=np.sqrt(weights @ shared**2),
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
