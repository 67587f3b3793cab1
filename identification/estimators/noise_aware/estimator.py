"""Fit a valve whose recorded force is noisy: parameters and paths together.

Output error takes the recorded force for exact; its noise then dithers the simulated bristle, and break-away force and
Stribeck velocity come out wrong by a multiple. Here the force is estimated along with the motion: each step linearises
all intervals along the present paths, filters, moves the parameters by Gauss-Newton on the innovations and the paths to
where the smoother sees them then (an iterated extended Kalman smoother with parameters).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from identification.budget import time_is_over
from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import UNIT_LOSS, Estimate, Innovations, handed_over, lean, totals
from identification.estimators.least_squares import gauss_newton
from identification.estimators.noise_aware.linearised_model import PathFreedom, first_path
from identification.estimators.noise_aware.predictor import KALMAN_SMOOTHER, Predictor
from identification.estimators.priors import prior
from identification.parallel import each
from recordings import Array
from simulator import Kernel

LONGEST = 0.4
"""Largest move of a coordinate in one step."""
HOLD = 1.0 / np.log(3.0) ** 2
"""Precision that keeps a coordinate near where it is in one step."""
NEW_PATH = 3
"""Steps of the path alone along which a fit starts."""
EQUAL = 1.0
"""Difference of two costs that noise gives."""
RELAXED = 2
"""Steps of the path alone after a step has failed."""
RESTING, DENSE = 4, 30.0
"""Steps of the path alone before a step of the parameters is judged, at most, and the positions in a second from
which that helps: between rarer ones paths come to rest so slowly that resting alone lowers the cost, whatever the step
did."""
SETTLED, MOST_FAILURES = 0.3, 4
"""A descent has settled with moves below so many standard deviations, or after so many failures in a row."""
STRICT = PathFreedom(1.0, 1e-5, 0.0, 2.5e-4, share=1.0)
"""The least freedom of the path: without allowance for the error of linearisation."""


@dataclass(frozen=True)
class NoiseAware:
    """The fit of one kernel of a force with error to some grids (a `PathEstimator`).

    kernel : with causality ``force with error``; coordinates : what is free; freedom : of the paths; worth : fall of
    the cost below which two steps in a row are the last of a descent; predictor : gives innovations and the next paths.
    """

    kernel: Kernel
    coordinates: Coordinates
    grids: Sequence[Grid]
    freedom: PathFreedom = STRICT
    worth: float = 0.0
    predictor: Predictor = KALMAN_SMOOTHER

    @property
    def names(self) -> tuple[str, ...]:
        """The free parameters, in the order of theta."""
        return self.coordinates.free_names

    @functools.cached_property
    def positions(self) -> int:
        """Number of measured positions."""
        return sum(int(np.isfinite(s.y).sum()) for s in self.grids)

    @functools.cached_property
    def dense(self) -> bool:
        """Whether positions are so close that resting paths can be waited for (`DENSE`)."""
        return self.positions > DENSE * sum(float(s.t[-1] - s.t[0]) for s in self.grids)

    @property
    def left(self) -> tuple[float, float]:
        """Falls of the cost by the normal equations below which no step is tried, at once and after one that failed:
        here every one is.
        """
        return 0.0, 0.0

    @functools.cached_property
    def held(self) -> Self:
        """The same with no parameter free: its passes take two thirds of the time, where only paths matter."""
        return replace(self, coordinates=self.coordinates.all_held())

    def with_freedom(self, freedom: PathFreedom) -> Self:
        """The same fit with another freedom of the paths."""
        return replace(self, freedom=freedom)

    def start(self, theta: Array, steps: int = NEW_PATH) -> Estimate | None:
        """The estimate at fixed parameters theta (m,), along new paths that start on the smoothed motion and take so
        many steps. None where the model diverges.
        """
        p = self.coordinates.p(theta)
        paths = each(lambda grid: first_path(self.kernel, grid, p), self.grids)
        known = [path for path in paths if path is not None]
        return self.along(theta, known, steps) if len(known) == len(paths) else None

    def along(self, theta: Array, paths: Sequence[Array], steps: int) -> Estimate | None:
        """The estimate at fixed parameters theta (m,) along paths, one (n, n_states) for every grid, after so many
        steps of the paths. None where the model diverges.
        """
        p, first = self.coordinates.p(theta), self.held if steps else self
        lines = each(lambda i: first.line(i, p, paths[i]), range(len(self.grids)))
        known = [line for line in lines if line is not None]
        return self._at_rest(theta, paths, known, steps) if len(known) == len(lines) else None

    def rested(self, now: Estimate, steps: int) -> Estimate | None:
        """An estimate after so many further steps of its paths. None where the model diverges."""
        return self._at_rest(now.theta, now.paths, now.linearised, steps)

    def _at_rest(
        self, theta: Array, paths: Sequence[Array], lines: Sequence[Innovations], steps: int
    ) -> Estimate | None:  # fmt: skip
        """The estimate from paths with the innovations about them, after so many steps."""
        p = self.coordinates.p(theta)
        ends = each(lambda i: self.relaxed(i, p, paths[i], lines[i], steps), range(len(self.grids)))
        found = [end for end in ends if end is not None]
        if len(found) < len(ends):
            return None
        return self._estimate(theta, tuple(path for path, _ in found), tuple(line for _, line in found))

    def line(self, i: int, p: Array, path: Array) -> Innovations | None:
        """The innovations of grid i about a path (n, n_states); None where the model has no solution."""
        return self.predictor.line(self.kernel, self.coordinates, self.grids[i], p, path, self.freedom)

    def relaxed(
        self, i: int, p: Array, path: Array, line: Innovations, steps: int
    ) -> tuple[Array, Innovations] | None:  # fmt: skip
        """A path of grid i, with the innovations about it, after so many steps to the smoothed one; None where the
        model diverges.
        """
        for left in reversed(range(steps)):
            path = path + self.predictor.toward(line, share=self.freedom.share)
            further = (self.held if left else self).line(i, p, path)
            if further is None:
                return None
            line = further
        return path, line

    def descend(self, now: Estimate, steps: int, vain: Callable[[Estimate], bool] | None = None) -> Estimate:
        """Gauss-Newton steps in a trust region, with damping that adapts; a step that raises the cost is taken back.
        vain : whether it is, to go on from an estimate.

        A step moves parameters and paths together to first order, and where something breaks away that is not enough:
        the cost rises by thousands until the paths have come to rest at the new parameters. So only then it is judged;
        judged at once, steps towards the truth are taken back, and a descent creeps and stops far from it. Likewise the
        cost about a path that is not yet the smoothed one can be too low, and then nothing is below it: after a failure
        the path is first brought to rest where it is.
        """
        damping, failures, settled, idle = 1e-3, 0, False, 0
        bounds = self.coordinates.bounds
        for _ in range(steps):
            if time_is_over():
                break
            before = now.cost
            stiff = now.normal.matrix + HOLD * np.eye(len(now.theta))
            held = replace(now.normal, matrix=stiff + damping * np.diag(np.diag(stiff)))
            solved = gauss_newton(held, now.theta, LONGEST, bounds)
            if solved is None:
                break
            if solved.free and solved.decrease < self.left[min(failures, 1)]:
                settled = True
                break
            step = solved.move
            trial = self.trial(now, step)
            small = bool(np.max(np.abs(step) / self._sigmas(now)) < SETTLED)
            gained = -np.inf if trial is None else self.gained(now, trial)
            brought, taken = 0.0, trial if gained > -EQUAL else None
            trial = None  # its matrices take as much again as those of what follows
            if taken is not None:
                settled, brought = small and gained < EQUAL, gained
                now, damping, failures = taken, max(damping / 5, 1e-9), 0
            elif failures == 0:
                now = self.rested(now, RELAXED) or now
                brought = before - now.cost
                damping, failures = max(5 * damping, 1e-3), 1
            else:
                damping, failures = max(20 * damping, 1e-3), failures + 1
                settled = (small and self.dense) or failures > MOST_FAILURES
            idle = idle + 1 if brought < self.worth else 0
            if settled or idle > 1 or (vain is not None and vain(now)):
                break
        return replace(now, settled=settled)

    def gained(self, now: Estimate, trial: Estimate) -> float:
        """By how much a trial explains more than an estimate, in units of the cost."""
        return now.cost - trial.cost

    def refit(
        self, theta: Array, paths: Sequence[Array], steps: int, vain: Callable[[Estimate], bool] | None = None
    ) -> Estimate | None:
        """The estimate after a descent along paths that another model left. None where the model diverges."""
        start = handed_over(self.along(theta, paths, 0))
        return self.descend(start.pop(), steps, vain) if start else None

    def trial(self, now: Estimate, step: Array) -> Estimate | None:
        """The estimate a step further, after as many steps of its paths as it needs to cost less, within reason."""
        trial = self.along(now.theta + step, self.moved(now, step), 0)
        for _ in range(RESTING if self.dense else 0):
            if trial is None or trial.cost < now.cost:
                break
            theta, paths = trial.theta, self.moved(trial, np.zeros(len(trial.theta)))
            trial = None  # its matrices take as much again as those of the next
            trial = self.along(theta, paths, 0)
        return trial

    def fit(self, theta: Array, steps: int, vain: Callable[[Estimate], bool] | None = None) -> Estimate | None:
        """The estimate after a descent from theta (m,) along new paths. vain : whether it is, to go on after a third of
        the steps, when new paths have come to rest. None where the model diverges.
        """
        start = handed_over(self.start(theta))
        if not start or vain is None:
            return self.descend(start.pop(), steps) if start else None
        first = handed_over(self.descend(start.pop(), steps // 3))
        if first[0].settled or vain(first[0]):
            return first[0]
        return self.descend(first.pop(), steps - steps // 3, vain)

    def first(self, theta: Array, steps: int) -> Estimate | None:
        """The estimate after a short descent from theta (m,) along new paths. None where the model diverges."""
        found = self.fit(theta, steps)
        return None if found is None else lean(found)

    def further(self, first: Estimate, steps: int, vain: Callable[[Estimate], bool]) -> Estimate:
        """The estimate after a further descent. vain : whether it is, to go on."""
        return self.refit(first.theta, first.paths, steps, vain) or first

    def _sigmas(self, now: Estimate) -> Array:
        return np.sqrt(np.maximum(np.diag(now.covariance), 1e-12))

    def moved(self, now: Estimate, step: Array) -> list[Array]:
        """The paths moved along with a step of the parameters."""
        move, share = step if step.any() else None, self.freedom.share
        lines = now.linearised
        return each(lambda i: now.paths[i] + self.predictor.toward(lines[i], move, share), range(len(self.grids)))

    def _estimate(self, theta: Array, paths: tuple[Array, ...], lines: tuple[Innovations, ...]) -> Estimate | None:
        total = prior(self.names, theta).plus(self.coordinates.told(theta))
        logs, loss, positions, far = 0.0, 0.0, 0, 0
        for line in lines:
            one = line.totals or totals(line)
            total, logs, loss = total.plus(one.normal), logs + one.logs, loss + one.loss_y
            positions, far = positions + one.positions, far + one.far
        if not np.isfinite(total.cost + logs):
            return None
        return Estimate(theta, paths, lines, total, total.cost + logs, loss / positions / UNIT_LOSS, far / positions)
