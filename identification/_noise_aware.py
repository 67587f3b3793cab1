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
from numpy.typing import NDArray

from identification._coordinates import Coordinates
from identification._experiment import Experiment
from identification._least_squares import Normal, move, weighted
from identification._linearised import Linearised, Looseness, Scene, first_path, linearise
from simulator import Kernel

Array = NDArray[np.float64]
T = TypeVar("T")

WORKERS = 2
TUNING = 3.0
"""Tuning of the Cauchy loss on normalised innovations, in sigmas."""
UNIT_LOSS = 0.8695
"""Expectation of that loss for a unit normal innovation."""
PATH_STEP = 0.6
"""Share of the way to the smoothed path that is gone in one step: the whole way diverges at break-aways."""
LONGEST = 0.4
"""Largest move of a coordinate in one step."""
HOLD = 1.0 / np.log(3.0) ** 2
"""Precision that keeps a coordinate near where it is in one step."""
OUTLIER = 4.0
"""Sigmas from which an innovation is an outlier."""

STAGES = (
    (Looseness(1.0, 1e-4, 0.1, 1e-3), 10),
    (Looseness(1.0, 1e-5, 0.1, 5e-4), 12),
)
"""Looseness and number of steps of the stages."""
Stages = Sequence[tuple[Looseness, int]]
SCREEN = Looseness(1.0, 1e-4, 0.1, 1e-3)
"""Looseness at which starts are compared."""


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
    """A step's outcome. theta (m,); paths and linearised, one per scene; normal : equations of the innovations with
    the priors; cost : robust loss plus log variances; loss : mean loss of a position innovation, 1 when all is right;
    outliers : share of innovations beyond `OUTLIER` sigmas.
    """

    theta: Array
    paths: tuple[Array, ...]
    linearised: tuple[Linearised, ...]
    normal: Normal
    cost: float
    loss: float
    outliers: float
    settled: bool = False

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) of theta: the Cramer-Rao bound of the linearised model."""
        return np.asarray(np.linalg.pinv(self.normal.matrix), float)

    def by_sample(self) -> list[Array]:
        """Square plus log variance of the innovations of each scene (n,), position and force together."""
        out = []
        for line in self.linearised:
            seen = np.isfinite(line.variances)
            variances = np.where(seen, line.variances, 1.0)
            out.append((line.innovations**2 / variances + np.log(variances)).sum(axis=1))
        return out


class NoiseAware:
    """The fit of one kernel (of an uncertain force) to some scenes, with what is free given by coordinates."""

    def __init__(self, kernel: Kernel, coordinates: Coordinates, scenes: Sequence[Scene]) -> None:
        self.kernel, self.coordinates, self.scenes = kernel, coordinates, tuple(scenes)
        self.names = [n for n, free in zip(coordinates.names, coordinates.free, strict=True) if free]

    def start(self, theta: Array, loose: Looseness, *, steps: int = 3) -> Estimate | None:
        """The estimate at fixed parameters, from paths along the smoothed motion. None where the model diverges."""
        p = self.coordinates.p(theta)
        paths = self._each(lambda i: first_path(self.kernel, self.scenes[i], p))
        return None if any(path is None for path in paths) else self.at(theta, paths, loose, steps=steps)

    def at(self, theta: Array, paths: Sequence[Array], loose: Looseness, *, steps: int = 1) -> Estimate | None:
        """The estimate at fixed parameters after some steps of the paths."""
        p, still = self.coordinates.p(theta), np.zeros(len(theta))

        def one(i: int) -> tuple[Array, Linearised] | None:
            path = paths[i]
            for left in range(steps, -1, -1):
                line = linearise(self.kernel, self.coordinates, self.scenes[i], p, path, loose)
                if line is None or not left:
                    break
                path = path + PATH_STEP * line.correction(still)
            return None if line is None else (path, line)

        found = self._each(one)
        if any(f is None for f in found):
            return None
        return self._judged(theta, tuple(f[0] for f in found), tuple(f[1] for f in found))

    def descend(self, now: Estimate, loose: Looseness, steps: int) -> Estimate:
        """Gauss-Newton steps with adaptive damping; a step that raises the cost is taken back."""
        damping, failures, settled = 1e-3, 0, False
        for _ in range(steps):
            held = replace(now.normal, matrix=now.normal.matrix + HOLD * np.eye(len(now.theta)))
            step = np.clip(move(held, damping), -LONGEST, LONGEST)
            moved = self._moved(now, step)
            trial = self.at(now.theta + step, moved, loose)
            if trial is not None and trial.cost < now.cost + 1.0:
                gain, now = now.cost - trial.cost, trial
                damping, failures = max(damping / 5, 1e-9), 0
                if gain < 1.0 and np.max(np.abs(step) / self._sigmas(now)) < 0.5:
                    settled = True
                    break
            else:
                damping, failures = max(20 * damping, 1e-3), failures + 1
                if failures > 3:
                    settled = True
                    break
        return replace(now, settled=settled)

    def follow(self, theta: Array, paths: Sequence[Array] | None = None, stages: Stages = STAGES) -> Estimate | None:
        """All stages from a start; None where the model diverges."""
        now: Estimate | None = None
        for loose, steps in stages:
            if now is not None:
                theta, paths = now.theta, now.paths
            begun = self.start(theta, loose) if paths is None else self.at(theta, paths, loose, steps=4)
            if begun is None:
                return now
            now = self.descend(begun, loose, steps)
        return now

    def strict(self, now: Estimate) -> Estimate | None:
        """The estimate without allowance for the error of linearisation, which makes costs of estimates comparable."""
        end = self.at(now.theta, now.paths, replace(STAGES[-1][0], curvature=0.0), steps=3)
        return None if end is None else replace(end, settled=now.settled)

    def _sigmas(self, now: Estimate) -> Array:
        return np.sqrt(np.maximum(np.diag(now.covariance), 1e-12))

    def _moved(self, now: Estimate, step: Array) -> list[Array]:
        return self._each(lambda i: now.paths[i] + PATH_STEP * now.linearised[i].correction(step))

    def _judged(self, theta: Array, paths: tuple[Array, ...], lines: tuple[Linearised, ...]) -> Estimate | None:
        total, cost, far, count, loss, seen_y = self._prior(theta), 0.0, 0, 0, 0.0, 0
        for line in lines:
            seen = np.isfinite(line.variances)
            sigma = np.sqrt(line.variances[seen])
            r = line.innovations[seen] / sigma
            one = weighted(r, line.by[seen] / sigma[:, None], TUNING)
            total = Normal(total.cost + one.cost, total.gradient + one.gradient, total.matrix + one.matrix)
            cost += 2 * float(np.sum(np.log(sigma)))
            far, count = far + int(np.sum(np.abs(r) > OUTLIER)), count + len(r)
            y = line.innovations[seen[:, 0], 0] / np.sqrt(line.variances[seen[:, 0], 0])
            loss, seen_y = loss + float(TUNING**2 * np.sum(np.log1p((y / TUNING) ** 2))), seen_y + len(y)
        if not np.isfinite(total.cost + cost):
            return None
        return Estimate(theta, paths, lines, total, total.cost + cost, loss / seen_y / UNIT_LOSS, far / count)

    def _prior(self, theta: Array) -> Normal:
        normal = Normal(0.0, np.zeros(len(theta)), np.zeros((len(theta), len(theta))))
        for prior in PRIORS:
            if not set(prior.weights) <= set(self.names):
                continue
            a = np.array([prior.weights.get(name, 0.0) for name in self.names])
            off = float(a @ theta) - prior.mean
            normal = Normal(
                normal.cost + (off / prior.std) ** 2,
                normal.gradient + off / prior.std**2 * a,
                normal.matrix + np.outer(a, a) / prior.std**2,
            )
        return normal

    def _each(self, task: Callable[[int], T]) -> list[T]:
        if len(self.scenes) == 1:
            return [task(0)]
        with ThreadPoolExecutor(WORKERS) as pool:
            return list(pool.map(task, range(len(self.scenes))))


def scenes(experiments: Sequence[Experiment]) -> list[Scene]:
    """The scenes of all segments."""
    pairs = [(s, e) for e in experiments for s in e.segments]
    with ThreadPoolExecutor(WORKERS) as pool:
        return list(pool.map(lambda pair: Scene.of(pair[0], pair[1].noise_position, pair[1].noise_force), pairs))


def fit_noise_aware(problem: NoiseAware, theta: Array) -> Estimate | None:
    """Fit from a start: other friction curves and bristles are tried first, the better followed through all stages.

    A fit that leaves outliers is followed again from where else the search could have started.
    """
    best: Estimate | None = None
    for start in _screened(problem, theta)[:STARTS]:
        end = problem.follow(start)
        end = None if end is None else problem.strict(end)
        if end is not None and (best is None or end.cost < best.cost):
            best = end
        if best is not None and converged(best):
            break
    return best


STARTS = 3
"""Starts that are followed at most."""
CLEAN_LOSS, CLEAN_OUTLIERS = 1.06, 1e-3
"""Mean loss and share of outliers up to which the innovations are those of the right model."""


def converged(estimate: Estimate) -> bool:
    """Whether the innovations look like noise."""
    return estimate.loss < CLEAN_LOSS and estimate.outliers < CLEAN_OUTLIERS


def _screened(problem: NoiseAware, theta: Array) -> list[Array]:
    """Starts, best first: greedy changes of a start, judged by the cost after a few steps of the path alone."""
    seen: list[tuple[float, Array]] = []

    def judge(candidate: Array) -> float:
        estimate = problem.start(candidate, SCREEN, steps=2)
        cost = np.inf if estimate is None else estimate.cost
        seen.append((cost, candidate))
        return cost

    best, cost = theta, judge(theta)
    for _ in range(2):
        before = cost
        for i in range(len(_changes(problem, best))):
            candidate = _changes(problem, best)[i]
            value = judge(candidate)
            if value < cost - 10.0:
                best, cost = candidate, value
        if before - cost < 0.01 * sum(len(s.t) for s in problem.scenes):
            break
    return [candidate for _, candidate in sorted(seen, key=lambda pair: pair[0])]


def _changes(problem: NoiseAware, theta: Array) -> list[Array]:
    """Other friction curves, bristles and masses, as coordinates."""
    p = problem.coordinates.p(theta)
    value = dict(zip(problem.coordinates.names, p.tolist(), strict=True))
    critical = 2 * np.sqrt(value["lugre.sigma0"] * value["mass.m"])
    others: list[dict[str, float]] = []
    others += [{"lugre.fs": 1.3 * value["lugre.fc"], "lugre.vs": vs} for vs in (1e-3, 3e-3, 8e-3)]
    others += [
        {"lugre.sigma0": f * value["lugre.sigma0"], "lugre.sigma1": np.sqrt(f) * value["lugre.sigma1"]}
        for f in (3.0, 0.3)
    ]
    others += [{"lugre.sigma1": ratio * critical} for ratio in (0.15, 0.4)]
    others += [{"mass.m": f * value["mass.m"]} for f in (3.0, 10.0)]
    return [problem.coordinates.theta(np.array([(value | o)[n] for n in problem.coordinates.names])) for o in others]
