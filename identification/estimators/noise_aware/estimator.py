"""Fit a valve whose recorded force is noisy: parameters and paths together.

Output error takes the recorded force for exact; its noise then dithers the simulated bristle, and break-away force and
Stribeck velocity come out wrong by a multiple. Here the force is estimated along with the motion: each step linearises
all intervals along the present paths, filters, moves the parameters by Gauss-Newton on the innovations and the paths to
where the smoother sees them then (an iterated extended Kalman smoother with parameters). At first the paths may stray
from the model, which keeps the problem smooth; the looseness is then taken away.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import Normal, move, weighted
from identification.estimators.noise_aware.linearised_model import Grid, Linearised, PathFreedom, first_path, linearise
from recordings import Array
from simulator import Kernel

T = TypeVar("T")

WORKERS = 2
TUNING = 3.0
"""Tuning of the Cauchy loss on normalised innovations, in sigmas."""
UNIT_LOSS = 0.8741
"""Expectation of that loss for a unit normal innovation."""
LONGEST = 0.4
"""Largest move of a coordinate in one step."""
HOLD = 1.0 / np.log(3.0) ** 2
"""Precision that keeps a coordinate near where it is in one step."""
RELAXED = 2
"""Steps of the path alone after a step has failed."""
RESTING, DENSE = 4, 30.0
"""Steps of the path alone before a step of the parameters is judged, at most, and the positions in a second from
which that helps: between rarer ones paths come to rest so slowly that resting alone lowers the cost, whatever the step
did."""
SETTLED, MOST_FAILURES = 0.3, 4
"""A descent has settled with moves below so many standard deviations, or after so many failures in a row."""
SWING, MOST_BETWEEN = 0.75, 2
"""Radians of a swing between nodes, and nodes per sample that are spent on it at most."""
OUTLIER = 4.0
"""Sigmas from which an innovation is an outlier."""

STAGES = (
    (PathFreedom(1.0, 1e-5, 0.05, 5e-4), 10),
    (PathFreedom(1.0, 1e-5, 0.02, 2.5e-4), 8),
)
"""PathFreedom and number of steps of the last stages, on whole recordings."""
SPARSE_STAGES = ((PathFreedom(1.0, 1e-4, 0.1, 5e-4), 5), *STAGES)
"""The same where positions are rare."""
STRICT = PathFreedom(1.0, 1e-5, 0.0, 2.5e-4, share=1.0)
STRICT_STEPS = 3
"""PathFreedom and number of steps of the path by which ends of fits are judged."""
Stages = Sequence[tuple[PathFreedom, int]]


@dataclass(frozen=True)
class Prior:
    """A weak normal prior on a sum of coordinates: weights by parameter name, mean and standard deviation."""

    weights: Mapping[str, float]
    mean: float
    std: float


PRIORS = (
    Prior({"lugre.fs": 1, "lugre.fc": -1}, float(np.log(1.3)), 0.4),
    Prior({"lugre.vs": 1}, float(np.log(4e-3)), 1.0),
    Prior({"mass.m": 1}, float(np.log(3.0)), 1.5),
    Prior({"lugre.sigma1": 2, "lugre.sigma0": -1, "mass.m": -1}, float(np.log(0.36)), 1.5),
)
"""What is known of LuGre friction before any measurement: it matters only where a recording says nothing."""


@dataclass(frozen=True)
class Estimate:
    """A step's outcome. theta (m,); paths and linearised, one per grid; normal : equations of the innovations with
    the priors; cost : robust loss plus log variances; loss : mean loss of a position innovation, 1 when all is right;
    outliers : share of those beyond `OUTLIER` sigmas; tuning : of the loss, inf for squares.
    """

    theta: Array
    paths: tuple[Array, ...]
    linearised: tuple[Linearised, ...]
    normal: Normal
    cost: float
    loss: float
    outliers: float
    settled: bool = False
    tuning: float = TUNING

    @property
    def samples(self) -> int:
        """Number of samples whose prediction is judged by `loss`."""
        return sum(int(np.isfinite(line.variances[:, 0]).sum()) for line in self.linearised)

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) of theta: the Cramer-Rao bound of the linearised model."""
        return np.asarray(np.linalg.pinv(self.normal.matrix), float)


class NoiseAware:
    """The fit of one kernel (of an uncertain force) to some grids, with what is free given by coordinates."""

    def __init__(self, kernel: Kernel, coordinates: Coordinates, grids: Sequence[Grid]) -> None:
        self.kernel, self.coordinates, self.grids = kernel, coordinates, tuple(grids)
        self.names = coordinates.free_names
        self.positions = sum(int(np.isfinite(s.y).sum()) for s in grids)
        self.dense = self.positions > DENSE * sum(float(s.t[-1] - s.t[0]) for s in grids)

    def line(self, grid: Grid, p: Array, path: Array, freedom: PathFreedom) -> Linearised | None:
        """A grid filtered along a path at parameters p; None where the model has no solution."""
        return linearise(self.kernel, self.coordinates, grid, p, path, freedom)

    def toward(self, line: Linearised, move: Array) -> Array:
        """The way (n, n_states) from a path to the one about which it is linearised next."""
        return line.correction(move)

    def start(self, theta: Array, freedom: PathFreedom, *, steps: int = 3) -> Estimate | None:
        """The estimate at fixed parameters, from paths along the smoothed motion. None where the model diverges."""
        p = self.coordinates.p(theta)
        paths = self._each(lambda i: first_path(self.kernel, self.grids[i], p))
        known = [path for path in paths if path is not None]
        return self.at(theta, known, freedom, steps=steps) if len(known) == len(paths) else None

    def at(self, theta: Array, paths: Sequence[Array], freedom: PathFreedom, *, steps: int = 1) -> Estimate | None:
        """The estimate at fixed parameters after some steps of the paths."""
        p, still = self.coordinates.p(theta), np.zeros(len(theta))

        def one(i: int) -> tuple[Array, Linearised] | None:
            path = paths[i]
            for left in range(steps, -1, -1):
                line = self.line(self.grids[i], p, path, freedom)
                if line is None or not left:
                    break
                path = path + freedom.share * self.toward(line, still)
            return None if line is None else (path, line)

        found = [f for f in self._each(one) if f is not None]
        if len(found) < len(self.grids):
            return None
        return self._judged(theta, tuple(f[0] for f in found), tuple(f[1] for f in found))

    def descend(
        self, now: Estimate, freedom: PathFreedom, steps: int, worth: float = 0.0,
        vain: Callable[[Estimate], bool] | None = None,
    ) -> Estimate:  # fmt: skip
        """Gauss-Newton steps with adaptive damping; a step that raises the cost is taken back. worth : fall of the cost
        below which two steps in a row are the last; vain : whether to go on from an estimate is.

        A step moves parameters and paths together to first order, and where something breaks away that is not enough:
        the cost rises by thousands until the paths have come to rest at the new parameters. So only then it is judged;
        judged at once, steps towards the truth are taken back, and a descent creeps and stops far from it. Likewise the
        cost about a path that is not yet the smoothed one can be too low, and then nothing is below it: after a failure
        the path is first brought to rest where it is.
        """
        damping, failures, settled, idle = 1e-3, 0, False, 0
        for _ in range(steps):
            before = now.cost
            held = replace(now.normal, matrix=now.normal.matrix + HOLD * np.eye(len(now.theta)))
            step = np.clip(move(held, damping), -LONGEST, LONGEST)
            trial = self._rested(
                self.at(now.theta + step, self._moved(now, step, freedom.share), freedom, steps=0), now.cost, freedom
            )
            small = bool(np.max(np.abs(step) / self._sigmas(now)) < SETTLED)
            if trial is not None and trial.cost < now.cost + 1.0:
                settled = small and now.cost - trial.cost < 1.0
                now, damping, failures = trial, max(damping / 5, 1e-9), 0
            elif failures == 0:
                now = self.at(now.theta, now.paths, freedom, steps=RELAXED) or now
                damping, failures = max(5 * damping, 1e-3), 1
            else:
                damping, failures = max(20 * damping, 1e-3), failures + 1
                settled = (small and self.dense) or failures > MOST_FAILURES
            idle = idle + 1 if before - now.cost < worth else 0
            if settled or idle > 1 or (vain is not None and vain(now)):
                break
        return replace(now, settled=settled)

    def _rested(self, trial: Estimate | None, below: float, freedom: PathFreedom) -> Estimate | None:
        """The trial after as many steps of its paths as it needs to cost less, within reason."""
        for _ in range(RESTING if self.dense else 0):
            if trial is None or trial.cost < below:
                break
            still = np.zeros(len(trial.theta))
            trial = self.at(trial.theta, self._moved(trial, still, freedom.share), freedom, steps=0)
        return trial

    def follow(
        self, theta: Array, paths: Sequence[Array] | None = None, stages: Stages = (), worth: float = 0.0
    ) -> Estimate | None:
        """All stages from a start, by default those for whole recordings; None where the model diverges. worth : as in
        `descend`.
        """
        now: Estimate | None = None
        stages = stages or (STAGES if self.dense else SPARSE_STAGES)
        for freedom, steps in stages:
            if now is not None:
                theta, paths = now.theta, now.paths
            begun = self.start(theta, freedom) if paths is None else self.at(theta, paths, freedom, steps=4)
            if begun is None:
                return now
            now = self.descend(begun, freedom, steps, worth)
        return now

    def strict(self, now: Estimate) -> Estimate | None:
        """The estimate without allowance for the error of linearisation, which makes costs of estimates comparable."""
        end = self.at(now.theta, now.paths, STRICT, steps=STRICT_STEPS)
        return None if end is None else replace(end, settled=now.settled)

    def _sigmas(self, now: Estimate) -> Array:
        return np.sqrt(np.maximum(np.diag(now.covariance), 1e-12))

    def _moved(self, now: Estimate, step: Array, share: float) -> list[Array]:
        still = np.zeros(len(step))

        def moved(i: int) -> Array:
            line, way = now.linearised[i], self.toward(now.linearised[i], step)
            return now.paths[i] + (way - (1 - share) * self.toward(line, still) if step.any() else share * way)

        return self._each(moved)

    def _judged(self, theta: Array, paths: tuple[Array, ...], lines: tuple[Linearised, ...]) -> Estimate | None:
        total, cost, far, loss, seen_y = prior(self.names, theta), 0.0, 0, 0.0, 0
        for line in lines:
            seen = np.isfinite(line.variances)
            sigma = np.sqrt(line.variances[seen])
            one = weighted(line.innovations[seen] / sigma, line.by[seen] / sigma[:, None], TUNING)
            total = Normal(total.cost, total.gradient + one.gradient, total.matrix + one.matrix)
            innovations, variances = line.judged
            sigma = np.sqrt(variances[seen])
            r = innovations[seen] / sigma
            total = replace(total, cost=total.cost + float(cauchy(r).sum()))
            cost += 2 * float(np.sum(np.log(sigma)))
            y = innovations[seen[:, 0], 0] / np.sqrt(variances[seen[:, 0], 0])
            loss, seen_y = loss + float(cauchy(y).sum()), seen_y + len(y)
            far += int(np.sum(np.abs(y) > OUTLIER))
        if not np.isfinite(total.cost + cost):
            return None
        return Estimate(theta, paths, lines, total, total.cost + cost, loss / seen_y / UNIT_LOSS, far / seen_y)

    def _each(self, task: Callable[[int], T]) -> list[T]:
        if len(self.grids) == 1:
            return [task(0)]
        with ThreadPoolExecutor(WORKERS) as pool:
            return list(pool.map(task, range(len(self.grids))))


def lean(estimate: Estimate) -> Estimate:
    """The estimate without what only a further step needs, which is most of its memory."""
    nothing = np.empty((0, 2, 0))
    lines = tuple(replace(line, by=nothing, _smoother=()) for line in estimate.linearised)
    return replace(estimate, linearised=lines)


def prior(names: Sequence[str], theta: Array) -> Normal:
    """Normal equations of `PRIORS`, those on coordinates that are free."""
    normal = Normal(0.0, np.zeros(len(theta)), np.zeros((len(theta), len(theta))))
    for one in PRIORS:
        if not set(one.weights) <= set(names):
            continue
        a = np.array([one.weights.get(name, 0.0) for name in names])
        off = float(a @ theta) - one.mean
        normal = Normal(
            normal.cost + (off / one.std) ** 2,
            normal.gradient + off / one.std**2 * a,
            normal.matrix + np.outer(a, a) / one.std**2,
        )
    return normal


def cauchy(r: Array, tuning: float = TUNING) -> Array:
    """Cauchy's loss of each normalised innovation, of any shape; squares where the tuning is infinite."""
    return np.asarray(r**2 if np.isinf(tuning) else tuning**2 * np.log1p((r / tuning) ** 2), float)


def grids(experiments: Sequence[Experiment]) -> list[Grid]:
    """The grids of all segments."""
    pairs = [(s, e) for e in experiments for s in e.segments]
    with ThreadPoolExecutor(WORKERS) as pool:
        return list(pool.map(lambda pair: Grid.of(pair[0], pair[1].noise_position, pair[1].noise_force), pairs))


def resolving(seen: Sequence[Grid], omega: float) -> list[Grid]:
    """Scenes with nodes close enough for a swing of omega [rad/s], within reason.

    Between nodes a break-away is linearised as a whole: where the mass swings on its bristles by more than a radian in
    that time, paths do not settle.
    """

    def between(grid: Grid) -> int:
        spacing = float(np.median(np.diff(grid.t)))
        return int(np.clip(np.ceil(omega * spacing / SWING), 1, MOST_BETWEEN))

    return [grid.divided(between(grid)) for grid in seen]
