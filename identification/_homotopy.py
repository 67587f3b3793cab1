"""From a rough start to the free-run fit: output error with ever rarer resets to the data, robust, then plain.

Plain output error converges only from a few percent off, because the timing of stick and slip makes its cost
multimodal. Resetting position and velocity to the data every `window` keeps the timing, while the bristle carries on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification._coordinates import Coordinates
from identification._experiment import Experiment, Segment
from identification._least_squares import Descent, Normal, descend
from identification._problem import Problem, Setting
from identification._start import LOOSE, precision
from simulator import Kernel

Array = NDArray[np.float64]

WINDOWS = (0.05, 0.2, 1.0)
"""Reset windows [s] of the early stages, which run on a part of long recordings."""
TUNING = 3.0
"""Tuning of the Cauchy loss in the robust stages, in sigmas of the measured noise."""
COARSE = 2e-3
"""Largest sub-step of the early stages [s]."""
FINEST = 4e-5
"""The sub-step is never refined below this [s]."""
STEP_ERROR = 0.02
"""The sub-step of the last stage is halved until its error is below this share of the residual, rms."""
SHARPENING = 1e-9
"""Damping of the last move; it grows where the move would not lower the cost."""
INSIGNIFICANT = 0.2
"""The last stages have settled when an iteration lowers the cost by less than this much of the residual's variance; one
standard deviation of a parameter costs a whole one."""
EARLY_SAMPLES = 15000
"""Early stages use at most about this many samples, in chunks spread over the recordings."""
CHUNK = 2500


@dataclass(frozen=True)
class Path:
    """Where a homotopy arrived: unknowns of the last stage, its normal equations and setting."""

    unknowns: Array
    normal: Normal
    setting: Setting
    evaluations: int
    settled: bool


class Homotopy:
    """The stages for one kernel, one set of coordinates and some experiments."""

    def __init__(
        self, kernel: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], last_window: float = np.inf
    ) -> None:
        self.last_window = last_window
        self.full = Problem(kernel, coordinates, experiments)
        self.early = Problem(kernel, coordinates, chunked(experiments))
        self.dt = min(s.dt for e in experiments for s in e.segments)
        self.longest = max(float(s.t[-1]) for e in experiments for s in e.segments)
        self.loose = 4 * precision(coordinates, LOOSE)
        self.coarse = min(self.dt, COARSE)

    def first(self, theta: Array) -> Descent | None:
        """The first robust stage alone: cheap, and its cost already tells a wrong basin from the right one."""
        return self._stage(self.early, theta, Setting(self.coarse, max(WINDOWS[0], 2 * self.dt), TUNING))

    def follow(self, theta: Array) -> Path | None:
        """All robust stages from a start; None when the model diverges everywhere."""
        used = 0
        for problem, setting in self._stages():
            end = self._stage(problem, theta, setting)
            if end is None:
                return None
            theta, used = end.theta[: len(theta)], used + end.evaluations
            path = Path(end.theta, end.normal, setting, used, end.settled)
        return path

    def _stages(self) -> list[tuple[Problem, Setting]]:
        early = [w for w in WINDOWS if self.dt < w < self.last_window]
        late = [w for w in (5.0, self.last_window) if w <= min(self.longest, self.last_window) or w == self.last_window]
        return [(self.early, Setting(self.coarse, w, TUNING)) for w in early] + [
            (self.full, Setting(self.coarse / 2, w, TUNING)) for w in late
        ]

    def polish(self, path: Path, iterations: int = 25) -> Path:
        """Plain least squares from where the robust stages arrived, with a sub-step fine enough for the noise."""
        setting, unknowns, used = replace(path.setting, tuning=np.inf), path.unknowns, path.evaluations
        level = path.normal.cost / self.full.samples
        end = self._plain(unknowns, setting, iterations, level)
        while end is not None:
            unknowns, used = end.theta, used + end.evaluations
            path = Path(unknowns, end.normal, setting, used, end.settled)
            finer = replace(setting, h_max=setting.h_max / 2)
            level = max(1.0, end.normal.cost / self.full.samples)
            if setting.h_max <= FINEST or self.step_error(unknowns, setting, finer) < STEP_ERROR * np.sqrt(level):
                break
            setting = finer
            end = self._plain(unknowns, setting, 6, level)
        return self._sharpened(path)

    def _sharpened(self, path: Path) -> Path:
        """One Gauss-Newton move with a quarter of the sub-step: a systematic error of the step, however small
        beside the noise of one sample, would weigh in thousands of them.
        """
        setting = replace(path.setting, h_max=path.setting.h_max / 4)
        evaluate = self.full.held(path.unknowns, setting, path.normal.cost / self.full.samples)
        end = descend(evaluate, path.unknowns, iterations=1, damping=SHARPENING)
        if end is None:
            return path
        return Path(end.theta, end.normal, setting, path.evaluations + end.evaluations, path.settled)

    def step_error(self, unknowns: Array, setting: Setting, finer: Setting) -> float:
        """Root mean square change of the prediction, in sigmas, when the sub-step is halved."""
        pairs = zip(self.full.responses(unknowns, setting), self.full.responses(unknowns, finer), strict=True)
        square = 0.0
        for piece, (a, b) in zip(self.full.pieces, pairs, strict=True):
            if a is None or b is None:
                return 0.0
            square += float(np.sum(((a.predicted - b.predicted) / piece.noise) ** 2))
        return float(np.sqrt(square / self.full.samples))

    def _plain(self, unknowns: Array, setting: Setting, iterations: int, level: float) -> Descent | None:
        evaluate = self.full.held(unknowns, setting, level)
        tolerance = max(1e-6, INSIGNIFICANT / self.full.samples)
        return descend(evaluate, unknowns, iterations=iterations, tolerance=tolerance, damping=1e-3)

    def _stage(self, problem: Problem, theta: Array, setting: Setting) -> Descent | None:
        unknowns = problem.start(theta)
        centre, wide = unknowns.copy(), np.zeros(len(unknowns))
        wide[: len(theta)] = self.loose

        def evaluate(x: Array) -> Normal | None:
            normal = problem.evaluate(x, setting)
            return None if normal is None else normal.with_prior(x, centre, wide)

        return descend(evaluate, unknowns, iterations=15, tolerance=1e-3)


def chunked(experiments: Sequence[Experiment]) -> list[Experiment]:
    """The experiments restricted to chunks spread evenly over them, when they are long."""
    total = sum(e.samples for e in experiments)
    if total <= 1.5 * EARLY_SAMPLES:
        return list(experiments)
    share = EARLY_SAMPLES / total
    return [e.with_segments(tuple(c for s in e.segments for c in _chunks(s, share))) for e in experiments]


def _chunks(segment: Segment, share: float) -> list[Segment]:
    n = len(segment.t)
    count = max(1, round(share * n / CHUNK))
    size = min(n, max(CHUNK if n > CHUNK else n, int(share * n / count)))
    firsts = np.linspace(0, n - size, count).astype(int)
    return [segment.part(first, first + size) for first in firsts]
