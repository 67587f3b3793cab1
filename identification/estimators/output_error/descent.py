"""From a start to the free-run fit: output error under a robust loss, then plain.

Plain output error converges only from a few percent off, because the timing of stick and slip makes its cost
multimodal. Where starting values are farther off, runs in windows come nearer: they keep the timing (`damped.py`).
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

TUNING = 3.0
"""Tuning of the Cauchy loss in the robust stage, in sigmas of the measured noise."""
ROBUST_STEPS, ROBUST_TOLERANCE = 15, 1e-3
"""Steps of a robust stage at most, and fall of the cost, as a share of it, that another one has to promise."""
LAST = 80
"""Steps of the last stage at most."""
COARSE = 1e-3
"""Largest sub-step of the robust stage [s]."""
FINEST = 4e-5
"""The sub-step is never refined below this [s]."""
STEP_ERROR = 0.02
"""The sub-step of later stages is halved until its error is below this share of the residual, rms."""
INSIGNIFICANT = 0.2
"""The last stages have settled when an iteration lowers the cost by less than this much of the residual's variance; one
standard deviation of a parameter costs a whole one."""
EARLY_SAMPLES, CHUNK = 15000, 2500
"""The robust stage of long recordings uses about this many samples, in chunks of so many spread over the recordings."""
EARLY_DT = 2e-3
"""Spacing of their samples at least [s]: closer ones say little more and leave chunks of a few strokes."""


@dataclass(frozen=True)
class Minimum:
    """Where a descent arrived: unknowns of the last stage, its normal equations and setting; level : mean cost of a
    sample, of the samples that were used.
    """

    unknowns: Array
    normal: Normal
    setting: ResidualForm
    evaluations: int
    settled: bool
    level: float = 1.0


class FreeRunDescent:
    """The stages for one kernel, one set of coordinates and some experiments."""

    def __init__(
        self, kernel: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], window: float = np.inf
    ) -> None:
        self.window = window
        self.full = Problem(kernel, coordinates, experiments)
        parts = chunked(experiments)
        self.early = self.full if parts is None else Problem(kernel, coordinates, parts)
        self.freedom = 4 * precision(coordinates, PRIOR_STD)
        self.coarse = min(COARSE, *(s.dt / 2 for e in self.early.experiments for s in e.segments))

    def follow(self, theta: Array) -> Minimum | None:
        """The robust stage from a start, on the chunks of long recordings; None where the model diverges."""
        setting = ResidualForm(self.coarse, self.window, TUNING)
        end = self._stage(self.early, theta, setting)
        if end is None:
            return None
        level = end.normal.cost / self.early.samples
        return Minimum(end.theta, end.normal, setting, end.evaluations, end.settled, level)

    def refined(self, minimum: Minimum | None) -> Minimum | None:
        """A minimum on whole recordings, in a sub-step that is fine enough for the noise, still under Cauchy's loss:
        where the sub-step moves a slip, plain squares begin ten thousand times above the noise, and no step leads back.
        None where the model diverges there, or for none.
        """
        if minimum is None:
            return None
        if self.early is not self.full:
            end = self._stage(self.full, minimum.unknowns[: self.full.n_free], minimum.setting)
            if end is None:
                return None
            minimum = self._at(end, minimum)
        setting = self._fine_enough(minimum.unknowns, minimum.setting, minimum.level)
        if setting == minimum.setting:
            return minimum
        evaluate = self.full.held(minimum.unknowns, setting, minimum.level)
        end = self._solved(self.full, evaluate, minimum.unknowns, ROBUST_STEPS, ROBUST_TOLERANCE)
        return minimum if end is None else self._at(end, replace(minimum, setting=setting))

    def polish(self, minimum: Minimum) -> Minimum:
        """Plain least squares from a refined minimum."""
        setting = replace(minimum.setting, tuning=np.inf)
        end = self._plain(minimum.unknowns, setting, LAST, minimum.level)
        while end is not None:
            minimum = self._at(end, replace(minimum, setting=setting))
            finer = self._fine_enough(minimum.unknowns, setting, minimum.level)
            if finer == setting:
                break
            setting = finer
            end = self._plain(minimum.unknowns, setting, 6, minimum.level)
        return self._sharpened(minimum)

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
        return replace(self._at(end, replace(minimum, setting=setting)), settled=minimum.settled)

    def _at(self, end: Solution, minimum: Minimum) -> Minimum:
        """The minimum on whole recordings where a descent from another has ended, in the setting of that."""
        used, level = minimum.evaluations + end.evaluations, end.normal.cost / self.full.samples
        return Minimum(end.theta, end.normal, minimum.setting, used, end.settled, level)

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
        unknowns = problem.start(theta, balanced=True)
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
