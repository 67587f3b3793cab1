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
from recordings import Array
from simulator import Catalogue, Kernel, Site, shows_imposed

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
    def of_segment(cls, s: Segment, e: Experiment, std: Array) -> ImposedGrid:
        """The grid of a segment. std (n,) [N] : of the residual of a complete model."""
        n, m = len(s.t), s.motion
        force = Force(s.u, np.zeros(n), std, np.zeros(n - 1), e.noise_force, 0.0)
        motion = np.column_stack([m.x, m.v, m.crept])
        return cls(s.t, s.y, s.u, force, e.noise_position, motion, driven=_driven(s), counts=s.seen & np.isfinite(std))

    def driven_along(self, path: Array) -> Array:
        """`driven`, whatever the path is."""
        return self.driven


def imposed_grids(experiments: Sequence[Experiment], kernel: Kernel, p: Array) -> list[Grid]:
    """The grids of experiments; a complete model's residual is the noise of the force, what the position's noise and
    the motion between samples do to the force that a model with parameters p predicts, and the memory at first.
    """
    pairs = [(e, close) for e, close in zip(experiments, map(closely_imposed, experiments), strict=True)]
    return [
        ImposedGrid.of_segment(s, close, std)
        for e, close in pairs
        for s, std in zip(close.segments, _errors(e, close, kernel, p), strict=True)
    ]


def showing(experiments: Sequence[Experiment], catalogue: Catalogue) -> tuple[str, ...]:
    """The effects of a catalogue that can show in a predicted force.

    Those on the input need a load beside it: where the load is all of the force, what they do to it cannot be told from
    what they do to its noise.
    """
    apart = all(e.causality == "motion" and any(np.ptp(s.load) > 0 for s in e.segments) for e in experiments)
    return tuple(e.id for e in catalogue.effects if shows_imposed(e) and (apart or e.site is Site.FORCE))


def _errors(e: Experiment, close: Experiment, kernel: Kernel, p: Array) -> Iterator[Array]:
    """Standard deviations [N] of the prediction of each segment (n,). What the motion adds is one figure for a whole
    segment, so that what is fitted is the error that is reported; what the memory adds, which nobody knows at first, is
    forgotten with the first motion.
    """
    plain = _predictions(close, kernel, p)
    square = np.full(len(plain), e.noise_force**2)
    draws = [(one, 1.0 / DRAWS) for one in disturbed(e, DRAWS, np.random.default_rng(0))]
    for other, share in (*draws, (thinned(e), 1.0)):
        square += [
            share * float(np.nan_to_num(np.mean((predicted - known) ** 2)))
            for predicted, known in zip(_predictions(other, kernel, p), plain, strict=True)
        ]
    held = dict(zip(kernel.parameters, p, strict=True))
    most = held["lugre.fc"] / held["lugre.sigma0"]  # the level that a motion leaves behind
    ends = [_predictions(close, kernel, p, z) for z in (-most, most)]
    for one, low, high in zip(square, *ends, strict=True):
        std = np.sqrt(one) + np.zeros(len(low))
        open_ = np.abs(high - low) > std
        std[: len(std) - int(np.argmax(open_[::-1])) if open_.any() else 0] = np.inf
        yield std


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
