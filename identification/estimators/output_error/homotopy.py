"""From a rough start to the free-run fit: output error with ever rarer resets to the data, robust, then plain.

Plain output error converges only from a few percent off, because the timing of stick and slip makes its cost
multimodal. Resetting position and velocity to the data every `window` keeps the timing, while the bristle carries on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.chunks import to_the_ends
from identification.data.experiment import Experiment, Segment
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import Normal, Solution, minimise
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.starting_values import PRIOR_STD, precision
from recordings import Array
from simulator import Kernel

WINDOW = 0.2
"""Reset window [s] of the first stage."""
TUNING = 3.0
"""Tuning of the Cauchy loss in the robust stages, in sigmas of the measured noise."""
ROBUST_STEPS, ROBUST_TOLERANCE = 15, 1e-3
"""Steps of a robust stage at most, and fall of the cost, as a share of it, that another one has to promise."""
COARSE = 2e-3
"""Largest sub-step of the early stages [s]."""
FINEST = 4e-5
"""The sub-step is never refined below this [s]."""
STEP_ERROR = 0.02
"""The sub-step of the last stage is halved until its error is below this share of the residual, rms."""
INSIGNIFICANT = 0.2
"""The last stages have settled when an iteration lowers the cost by less than this much of the residual's variance; one
standard deviation of a parameter costs a whole one."""
EARLY_SAMPLES, CHUNK = 15000, 2500
"""Early stages of long recordings use about this many samples, in chunks of so many spread over the recordings."""
EARLY_DT = 2e-3
"""Spacing of their samples at least [s]: closer ones say little more and leave chunks of a few strokes."""


@dataclass(frozen=True)
class Minimum:
    """Where a homotopy arrived: unknowns of the last stage, its normal equations and setting; level : mean cost of a
    sample, of the samples that were used.
    """

    unknowns: Array
    normal: Normal
    setting: ResidualForm
    evaluations: int
    settled: bool
    level: float = 1.0


class Homotopy:
    """The stages for one kernel, one set of coordinates and some experiments."""

    def __init__(
        self, kernel: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], last_window: float = np.inf
    ) -> None:
        self.last_window = last_window
        self.full = Problem(kernel, coordinates, experiments)
        parts = chunked(experiments)
        self.early = self.full if parts is None else Problem(kernel, coordinates, parts)
        self.dt = min(s.dt for e in self.early.experiments for s in e.segments)
        self.freedom = 4 * precision(coordinates, PRIOR_STD)
        self.coarse = min(self.dt, COARSE)

    def first(self, theta: Array) -> Solution | None:
        """The first robust stage alone: cheap, and its cost already tells a wrong basin from the right one."""
        return self._stage(self.early, theta, ResidualForm(self.coarse, max(WINDOW, 2 * self.dt), TUNING))

    def follow(self, theta: Array) -> Minimum | None:
        """All robust stages from a start, on the chunks of long recordings; None when the model diverges everywhere."""
        used = 0
        for setting in self._settings():
            end = self._stage(self.early, theta, setting)
            if end is None:
                return None
            theta, used = end.theta[: len(theta)], used + end.evaluations
            minimum = Minimum(end.theta, end.normal, setting, used, end.settled, end.normal.cost / self.early.samples)
        return minimum

    def _settings(self) -> list[ResidualForm]:
        first = [ResidualForm(self.coarse, WINDOW, TUNING)] if self.dt < WINDOW < self.last_window else []
        return [*first, ResidualForm(self.coarse / 2, self.last_window, TUNING)]

    def carried(self, minimum: Minimum) -> Minimum | None:
        """A minimum on chunks carried to whole recordings; None where the model diverges there."""
        if self.early is self.full:
            return minimum
        end = self._stage(self.full, minimum.unknowns[: self.full.n_free], minimum.setting)
        if end is None:
            return None
        level = end.normal.cost / self.full.samples
        return Minimum(
            end.theta, end.normal, minimum.setting, minimum.evaluations + end.evaluations, end.settled, level
        )

    def polish(self, minimum: Minimum, iterations: int = 80) -> Minimum:
        """Plain least squares from where the robust stages arrived, with a sub-step fine enough for the noise."""
        setting = self._fine_enough(minimum.unknowns, replace(minimum.setting, tuning=np.inf), minimum.level)
        end = self._plain(self._robust(minimum, setting), setting, iterations, minimum.level)
        while end is not None:
            level = end.normal.cost / self.full.samples
            minimum = Minimum(end.theta, end.normal, setting, minimum.evaluations + end.evaluations, end.settled, level)
            finer = self._fine_enough(minimum.unknowns, setting, minimum.level)
            if finer == setting:
                break
            setting = finer
            end = self._plain(minimum.unknowns, setting, 6, minimum.level)
        return self._sharpened(minimum)

    def _robust(self, minimum: Minimum, setting: ResidualForm) -> Array:
        """The unknowns of a minimum in the sub-step of a setting, under Cauchy's loss: where the sub-step moves a slip,
        plain squares begin ten thousand times above the noise, and no step leads back.
        """
        if setting.h_max == minimum.setting.h_max:
            return minimum.unknowns
        evaluate = self.full.held(minimum.unknowns, replace(setting, tuning=TUNING), minimum.level)
        end = self._solved(self.full, evaluate, minimum.unknowns, ROBUST_STEPS, ROBUST_TOLERANCE)
        return minimum.unknowns if end is None else end.theta

    def _fine_enough(self, unknowns: Array, setting: ResidualForm, level: float) -> ResidualForm:
        """The setting with the sub-step halved until its error is small beside the residual."""
        while setting.h_max > FINEST:
            finer = replace(setting, h_max=setting.h_max / 2)
            if self.step_error(unknowns, setting, finer) < STEP_ERROR * np.sqrt(max(1.0, level)):
                break
            setting = finer
        return setting

    def _sharpened(self, minimum: Minimum) -> Minimum:
        """One Gauss-Newton move with a quarter of the sub-step: a systematic error of the step, however small
        beside the noise of one sample, would weigh in thousands of them.
        """
        setting = replace(minimum.setting, h_max=minimum.setting.h_max / 4)
        evaluate = self.full.held(minimum.unknowns, setting, minimum.level)
        end = self._solved(self.full, evaluate, minimum.unknowns, 1, 0.0)
        if end is None:
            return minimum
        level = end.normal.cost / self.full.samples
        return Minimum(end.theta, end.normal, setting, minimum.evaluations + end.evaluations, minimum.settled, level)

    def step_error(self, unknowns: Array, setting: ResidualForm, finer: ResidualForm) -> float:
        """Root mean square change of the prediction, in sigmas, when the sub-step is halved."""
        pairs = zip(self.full.responses(unknowns, setting), self.full.responses(unknowns, finer), strict=True)
        square = 0.0
        for piece, (a, b) in zip(self.full.pieces, pairs, strict=True):
            if a is None or b is None:
                return 0.0
            square += float(np.sum(((a.predicted - b.predicted) / piece.noise) ** 2))
        return float(np.sqrt(square / self.full.samples))

    def _plain(self, unknowns: Array, setting: ResidualForm, iterations: int, level: float) -> Solution | None:
        evaluate = self.full.held(unknowns, setting, level)
        tolerance = max(1e-6, INSIGNIFICANT / self.full.samples)
        return self._solved(self.full, evaluate, unknowns, iterations, tolerance)

    def _stage(self, problem: Problem, theta: Array, setting: ResidualForm) -> Solution | None:
        unknowns = problem.start(theta)
        centre, wide = unknowns.copy(), np.zeros(len(unknowns))
        wide[: len(theta)] = self.freedom

        def evaluate(x: Array) -> Normal | None:
            normal = problem.evaluate(x, setting)
            return None if normal is None else normal.with_prior(x, centre, wide)

        return self._solved(problem, evaluate, unknowns, ROBUST_STEPS, ROBUST_TOLERANCE)

    @staticmethod
    def _solved(
        problem: Problem, evaluate: Callable[[Array], Normal | None], unknowns: Array, iterations: int, tolerance: float
    ) -> Solution | None:
        bounds = problem.coordinates.bounds.padded(len(unknowns))
        return minimise(evaluate, unknowns, bounds=bounds, iterations=iterations, tolerance=tolerance)


def chunked(experiments: Sequence[Experiment]) -> list[Experiment] | None:
    """The experiments restricted to chunks spread evenly over them; None where they are short."""
    total = sum(e.samples for e in experiments)
    if total <= 1.5 * EARLY_SAMPLES:
        return None
    every = max(1, int(EARLY_DT / min(s.dt for e in experiments for s in e.segments) + 1e-9))
    share = min(1.0, EARLY_SAMPLES * every / total)
    return [e.with_segments(tuple(c for s in e.segments for c in _chunks(s, share, every))) for e in experiments]


def _chunks(segment: Segment, share: float, every: int) -> list[Segment]:
    n, least = len(segment.t), CHUNK * every
    count = max(1, round(share * n / least))
    size = min(n, max(least, int(share * n / count)))
    return [segment.part(chunk.start, chunk.stop, every) for chunk in to_the_ends(n, size, count)]
