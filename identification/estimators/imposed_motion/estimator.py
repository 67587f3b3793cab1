"""Tracing where a rig imposes the motion, or where no spring holds the valve: the force is predicted from the motion.

Free runs of a plant without spring integrate every error of the model without limit, and with an imposed motion there
is nothing to run. What such recordings say of friction is the force that their motion took. The fit here offers what
`NoiseAware` offers, so that candidates are sought, judged and named in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.data.experiment import Experiment, Segment, blurred, imposed, redrawn
from identification.data.force import Force
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import Normal, descend, weighted
from identification.estimators.noise_aware.estimator import OUTLIER, Estimate, prior
from identification.estimators.noise_aware.linearised_model import Grid, Linearised, PathFreedom
from recordings import Array
from simulator import CATALOGUE, Kernel, Site, shows_imposed

BEGINNING = 0.05
"""Share of the travel after which memory has forgotten where it started; what is before does not count."""
DRAWS = 4
"""Draws of the position's noise."""
FREE = float(np.log(10.0))
"""A coordinate may move by so much from where a descent starts before that costs as much as one residual."""


@dataclass(frozen=True, kw_only=True)
class ImposedGrid(Grid):
    """A segment with its motion imposed. driven (n, 4) : x, v, a and load; counts (n,) : the samples that are judged;
    force : as recorded, its std that of what a complete model leaves.
    """

    driven: Array
    counts: NDArray[np.bool_]

    @classmethod
    def seen(cls, s: Segment, e: Experiment, std: float) -> ImposedGrid:
        """The grid of a segment."""
        n, m = len(s.t), s.motion
        force = Force(s.u, np.zeros(n), np.full(n, std), np.zeros(n - 1), e.noise_force, 0.0)
        far = np.abs(m.x - m.x[0]) > BEGINNING * np.ptp(m.x)
        counts = s.seen & (np.arange(n) >= np.argmax(far))
        driven = np.column_stack([m.x, m.crept, m.a, s.load])
        motion = np.column_stack([m.x, m.v, m.crept])
        return cls(s.t, s.y, s.u, force, e.noise_position, motion, driven=driven, counts=counts)


def imposed_grids(experiments: Sequence[Experiment], kernel: Kernel, p: Array) -> list[Grid]:
    """The grids of experiments; what a complete model leaves is the noise of the force, and what the noise of the
    position does to the force that a model with parameters p predicts.
    """
    return [
        ImposedGrid.seen(s, e, std)
        for e, stds in ((imposed(e), _left_by_noise(e, kernel, p)) for e in experiments)
        for s, std in zip(e.segments, stds, strict=True)
    ]


def showing(experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """The effects that can show in a predicted force.

    Those on the input need a load beside it: where the load is all of the force, what they do to it cannot be told from
    what they do to its noise.
    """
    apart = all(e.causality == "motion" and any(np.ptp(s.load) > 0 for s in e.segments) for e in experiments)
    return tuple(e for e in CATALOGUE.ids if shows_imposed(CATALOGUE[e]) and (apart or CATALOGUE[e].site is Site.FORCE))


def _left_by_noise(e: Experiment, kernel: Kernel, p: Array) -> list[float]:
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
    grids = [ImposedGrid.seen(s, e, 1.0) for s in e.segments]
    return [kernel.run(s.t, s.driven, p, _start(kernel, s)).outputs[:, 0] for s in grids]


def _start(kernel: Kernel, grid: ImposedGrid) -> Array:
    return kernel.start(grid.driven[0, 0], 0.0, grid.driven[0, 3])


class ImposedFit:
    """The fit of one motion-driven kernel to some grids, by squares of the force."""

    def __init__(self, kernel: Kernel, coordinates: Coordinates, grids: Sequence[Grid]) -> None:
        self.kernel, self.coordinates = kernel, coordinates
        self.grids = tuple(grid for grid in grids if isinstance(grid, ImposedGrid))
        self.names = coordinates.free_names

    def start(self, theta: Array, freedom: PathFreedom, *, steps: int = 0) -> Estimate | None:
        """The estimate at fixed parameters. None where the model diverges."""
        return self.at(theta, (), freedom, steps=steps)

    def at(self, theta: Array, paths: Sequence[Array], freedom: PathFreedom, *, steps: int = 0) -> Estimate | None:
        """The same: there are no paths to be found."""
        p = self.coordinates.p(theta)
        found = [self._line(grid, p) for grid in self.grids]
        pairs = [pair for pair in found if pair is not None]
        return self._judged(theta, pairs) if len(pairs) == len(found) else None

    def descend(self, now: Estimate, freedom: PathFreedom, steps: int, worth: float = 0.0) -> Estimate:
        """At most so many damped Gauss-Newton steps."""
        hold = np.full(len(now.theta), max(now.loss, 1.0) / FREE**2)

        def evaluate(theta: Array) -> Normal | None:
            found = self.at(theta, (), freedom)
            return None if found is None else found.normal.with_prior(theta, now.theta, hold)

        end = descend(evaluate, now.theta, iterations=steps, tolerance=1e-4, longest=0.5)
        found = None if end is None else self.at(end.theta, (), freedom)
        return now if end is None or found is None else replace(found, settled=end.settled)

    def follow(
        self, theta: Array, paths: Sequence[Array] | None = None, stages: Sequence[tuple[PathFreedom, int]] = (),
        worth: float = 0.0,
    ) -> Estimate | None:  # fmt: skip
        """All stages from a start; None where the model diverges."""
        now: Estimate | None = None
        for freedom, steps in stages:
            now = self.start(theta, freedom) if now is None else now
            if now is None:
                return None
            now = self.descend(now, freedom, steps)
        return now

    def _line(self, grid: ImposedGrid, p: Array) -> tuple[Array, Linearised] | None:
        run = self.kernel.run(grid.t, grid.driven, p, _start(self.kernel, grid), sensitivities=True)
        if run.failed is not None or run.jacobian is None:
            return None
        predicted, nothing = run.outputs[:, 0], np.zeros(len(grid.t))
        by = run.jacobian[:, 0, : len(p)][:, self.coordinates.free] * self.coordinates.slope(p)
        innovations = np.column_stack([np.where(grid.counts, grid.u - predicted, 0.0), nothing])
        variances = np.column_stack([np.where(grid.counts, grid.force.std**2, np.inf), nothing + np.inf])
        path = np.column_stack([grid.motion[:, 0], grid.motion[:, 1], predicted, nothing])
        line = Linearised(
            innovations, variances, np.stack([-by, np.zeros_like(by)], axis=1), (innovations, variances), ()
        )
        return path, line

    def _judged(self, theta: Array, pairs: Sequence[tuple[Array, Linearised]]) -> Estimate | None:
        normal, logs, far, count, square = prior(self.names, theta), 0.0, 0, 0, 0.0
        for _, line in pairs:
            seen = np.isfinite(line.variances[:, 0])
            sigma = np.sqrt(line.variances[seen, 0])
            r = line.innovations[seen, 0] / sigma
            one = weighted(r, line.by[seen, 0] / sigma[:, None], float("inf"))
            normal = Normal(normal.cost + one.cost, normal.gradient + one.gradient, normal.matrix + one.matrix)
            logs, square = logs + 2 * float(np.log(sigma).sum()), square + one.cost
            far, count = far + int((np.abs(r) > OUTLIER).sum()), count + len(r)
        if not np.isfinite(normal.cost):
            return None
        paths, lines = zip(*pairs, strict=True)
        return Estimate(
            theta, paths, lines, normal, normal.cost + logs, square / count, far / count, tuning=float("inf")
        )  # fmt: skip
