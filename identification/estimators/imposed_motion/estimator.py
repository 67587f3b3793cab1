"""The estimator of tracing where a rig imposes the motion, or where no spring holds the valve: the force is predicted.

Free runs of a plant without spring integrate every error of the model without limit, and with an imposed motion there
is nothing to run. What such recordings say of friction is the force that their motion took. `ImposedMotion` keeps the
same protocol as `NoiseAware` (`path_estimator.py`), so that candidates are tried, judged and named in the same way. It
starts where the output-error fit of `fit.py` has led, and says there how the two differ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import OUTLIER, Estimate, Innovations
from identification.estimators.imposed_motion.grid import ImposedGrid, first_state
from identification.estimators.least_squares import Normal, minimise, weighted
from identification.estimators.priors import prior
from recordings import Array
from simulator import Kernel

FREE = float(np.log(10.0))
"""A coordinate may move by so much from where a descent starts before that costs as much as one residual."""


class ImposedMotion:
    """The fit of one motion-driven kernel to some grids, by squares of the force (a `PathEstimator`).

    kernel : with causality ``motion``; coordinates : what is free; grids : those of a motion that is imposed, others
    are passed over.
    """

    def __init__(self, kernel: Kernel, coordinates: Coordinates, grids: Sequence[Grid]) -> None:
        self.kernel, self.coordinates = kernel, coordinates
        self.grids = tuple(grid for grid in grids if isinstance(grid, ImposedGrid))
        self.names = coordinates.free_names

    def start(self, theta: Array, steps: int = 0) -> Estimate | None:
        """The estimate at parameters theta (m,), which its paths follow from. None where the model diverges."""
        return self.along(theta, (), steps)

    def along(self, theta: Array, _paths: Sequence[Array], _steps: int) -> Estimate | None:
        """The same: no path is free here."""
        p = self.coordinates.p(theta)
        found = [self._line(grid, p) for grid in self.grids]
        pairs = [pair for pair in found if pair is not None]
        return self._estimate(theta, pairs) if len(pairs) == len(found) else None

    def refit(
        self, theta: Array, paths: Sequence[Array], steps: int, _vain: Callable[[Estimate], bool] | None = None
    ) -> Estimate | None:
        """`fit`: no path is left over."""
        now = self.along(theta, paths, 0)
        return None if now is None else self.descend(now, steps)

    def descend(self, now: Estimate, steps: int, _vain: Callable[[Estimate], bool] | None = None) -> Estimate:
        """The estimate after at most so many Gauss-Newton steps."""
        hold = np.full(len(now.theta), max(now.loss, 1.0) / FREE**2)

        def evaluate(theta: Array) -> Normal | None:
            found = self.start(theta)
            return None if found is None else found.normal.with_prior(theta, now.theta, hold)

        bounds = self.coordinates.bounds
        end = minimise(evaluate, now.theta, bounds=bounds, iterations=steps, tolerance=1e-4, radius=0.5)
        found = None if end is None else self.start(end.theta)
        return now if end is None or found is None else replace(found, settled=end.settled)

    def fit(self, theta: Array, steps: int, _vain: Callable[[Estimate], bool] | None = None) -> Estimate | None:
        """The estimate after a descent from theta (m,). None where the model diverges."""
        first = self.start(theta)
        return None if first is None else self.descend(first, steps)

    def first(self, theta: Array, steps: int) -> Estimate | None:
        """The estimate after a short descent from theta (m,). None where the model diverges."""
        return self.fit(theta, steps)

    def further(self, first: Estimate, steps: int, _vain: Callable[[Estimate], bool]) -> Estimate:
        """The estimate after a further descent, which costs little."""
        return self.descend(first, steps)

    def _line(self, grid: ImposedGrid, p: Array) -> tuple[Array, Innovations] | None:
        run = self.kernel.run(grid.t, grid.driven, p, first_state(self.kernel, grid.driven), sensitivities=True)
        if run.failed is not None or run.jacobian is None:
            return None
        predicted, nothing = run.outputs[:, 0], np.zeros(len(grid.t))
        by = run.jacobian[:, 0, : len(p)][:, self.coordinates.free] * self.coordinates.slope(p)
        apart = grid.apart(np.column_stack([grid.u - predicted, by]))
        innovations = np.column_stack([apart[:, 0], nothing])
        variances = np.column_stack([np.where(grid.counts, grid.force.std**2, np.inf), nothing + np.inf])
        path = np.column_stack([grid.motion[:, 0], grid.motion[:, 1], predicted, nothing])
        both = np.stack([-apart[:, 1:], np.zeros_like(by)], axis=1)
        return path, Innovations(innovations, variances, both, (innovations, variances))

    def _estimate(self, theta: Array, pairs: Sequence[tuple[Array, Innovations]]) -> Estimate | None:
        normal, logs, far, count, square = prior(self.names, theta).plus(self.coordinates.told(theta)), 0.0, 0, 0, 0.0
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
