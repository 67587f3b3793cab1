"""The grid of a segment whose motion is imposed: what drives the model, which samples count, and with what error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.data.experiment import Experiment, Segment, blurred, imposed, redrawn
from identification.data.force import Force
from identification.data.grid import Grid
from recordings import Array
from simulator import Catalogue, Kernel, Site, shows_imposed

BEGINNING = 0.05
"""Share of the travel after which memory has forgotten where it started; what is before does not count."""
DRAWS = 4
"""Draws of the position's noise."""


@dataclass(frozen=True, kw_only=True)
class ImposedGrid(Grid):
    """A segment with its motion imposed. driven (n, 4) : x, v, a and load; counts (n,) : the samples that are judged;
    force : as recorded, its std that of the residual of a complete model.
    """

    driven: Array
    counts: NDArray[np.bool_]

    @classmethod
    def of_segment(cls, s: Segment, e: Experiment, std: float) -> ImposedGrid:
        """The grid of a segment."""
        n, m = len(s.t), s.motion
        force = Force(s.u, np.zeros(n), np.full(n, std), np.zeros(n - 1), e.noise_force, 0.0)
        far = np.abs(m.x - m.x[0]) > BEGINNING * np.ptp(m.x)
        counts = s.seen & (np.arange(n) >= np.argmax(far))
        driven = np.column_stack([m.x, m.crept, m.a, s.load])
        motion = np.column_stack([m.x, m.v, m.crept])
        return cls(s.t, s.y, s.u, force, e.noise_position, motion, driven=driven, counts=counts)

    def driven_along(self, path: Array) -> Array:
        """`driven`, whatever the path is."""
        return self.driven


def imposed_grids(experiments: Sequence[Experiment], kernel: Kernel, p: Array) -> list[Grid]:
    """The grids of experiments; a complete model's residual is the noise of the force, and what the noise of the
    position does to the force that a model with parameters p predicts.
    """
    return [
        ImposedGrid.of_segment(s, e, std)
        for e, stds in ((imposed(e), _noise_of_prediction(e, kernel, p)) for e in experiments)
        for s, std in zip(e.segments, stds, strict=True)
    ]


def showing(experiments: Sequence[Experiment], catalogue: Catalogue) -> tuple[str, ...]:
    """The effects of a catalogue that can show in a predicted force.

    Those on the input need a load beside it: where the load is all of the force, what they do to it cannot be told from
    what they do to its noise.
    """
    apart = all(e.causality == "motion" and any(np.ptp(s.load) > 0 for s in e.segments) for e in experiments)
    return tuple(e.id for e in catalogue.effects if shows_imposed(e) and (apart or e.site is Site.FORCE))


def _noise_of_prediction(e: Experiment, kernel: Kernel, p: Array) -> list[float]:
    """Standard deviations [N] per segment, from repetitions of the recording with as much noise again, and from one
    that is smoothed over twice the time: where a valve slips, smoothing blurs the motion that the force is predicted
    from. One for a whole segment, so that what is fitted is the error that is reported.
    """
    rng = np.random.default_rng(0)
    plain, square = _predictions(imposed(e), kernel, p), np.full(len(e.segments), e.noise_force**2)
    others = [(redrawn(e, rng), 1.0 / DRAWS) for _ in range(DRAWS)]
    for other, share in (*others, (blurred(e), 1.0)):
        for i, predicted in enumerate(_predictions(imposed(other), kernel, p)):
            square[i] += share * float(np.nan_to_num(np.mean((predicted - plain[i]) ** 2)))
    return list(np.sqrt(square))


def _predictions(e: Experiment, kernel: Kernel, p: Array) -> list[Array]:
    grids = [ImposedGrid.of_segment(s, e, 1.0) for s in e.segments]
    return [kernel.run(s.t, s.driven, p, first_state(kernel, s)).outputs[:, 0] for s in grids]


def first_state(kernel: Kernel, grid: ImposedGrid) -> Array:
    """The state (n_states,) at the beginning of a grid."""
    return kernel.start(grid.driven[0, 0], 0.0, grid.driven[0, 3])
