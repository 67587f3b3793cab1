"""Starting values from runs that are set back to the data: what one slip does, on the smoothed force.

Spring, preload and the level of friction are read from the loop of force over position; what it does not tell starts
evenly spread. The model takes damped steps here, whatever the sampling resolves: they need to follow the slip, and the
cost is smooth then. Where a fit ends is near enough for the noise-aware fit, which goes on from there.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from identification.data.chunks import to_the_ends
from identification.data.experiment import Experiment, Segment
from identification.estimators.anchors import anchors
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import Solution, cauchy, minimise
from identification.estimators.order import sub_step
from identification.estimators.output_error.force_position_loop import ForcePositionLoop
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.replicates import in_windows
from recordings import Array, Progress, silent
from simulator import Kernel

WINDOW = 0.25
"""A run is set back to the data once in so many seconds."""
FEWEST = 5
"""Samples between two settings back."""
TUNINGS = (100.0, 20.0)
"""Tunings of the Cauchy loss, in sigmas, one after the other: to the first, a slip that is missed is a small error."""
STARTS, FOLLOWED = 64, 4
"""Starts that are compared, and those of them that are followed."""
SEARCHED, CHUNK = 60.0, 10.0
"""Seconds of the recordings that are searched on, in chunks of so many."""
MOST_SAMPLES = 12000
"""Samples that are searched on at most: closer ones are thinned, for a slip takes longer than they are apart."""
ITERATIONS = 10
"""Steps of a stage."""
GUESSED = 0.03
"""Share of the level of friction by which a straight line between samples may miss the force; beyond, what the valve
did until the next setting back is not held against the model."""
RANGES = {
    "lugre.fc": (0.5, 1.0), "lugre.fs": (1.0, 1.6), "mass.m": (1.0, 8.0), "lugre.sigma2": (100.0, 1500.0),
    "lugre.vs": (1e-3, 1e-2), "lugre.sigma0": (3e5, 1e8),
}  # fmt: skip
"""Ranges of the starts, SI units, but for the levels of friction: those are shares of the half width of the loop. It is
the static friction of a valve that sticks and slips, and the Coulomb friction of one that slides through."""


class WindowSearch:
    """The way from the loop of force over position to starting values.

    model : of damped steps, force-driven; smooth : the experiments, with a smooth force; loop : what is read from them.
    """

    def __init__(
        self, model: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], loop: ForcePositionLoop
    ) -> None:
        self.coordinates, self.loop = coordinates, loop
        self.problem = Problem(model, coordinates, _parts(told(smooth, loop)), loop)
        self.window = window(self.problem.spacing)
        self.h = sub_step({"spring.K": loop.K, "mass.m": RANGES["mass.m"][0]})
        self.evaluations = 0

    def ends(self, progress: Progress = silent) -> list[Solution]:
        """Where the likeliest starts lead, the best first."""
        found = list[Solution]()
        for done, theta in enumerate(self._ranked(self._starts())[:FOLLOWED]):
            progress("search", done, FOLLOWED)
            end = self._staged(theta)
            found += [] if end is None else [end]
        return sorted(found, key=lambda end: end.normal.cost)

    def _ranked(self, starts: Sequence[Array]) -> list[Array]:
        """The starts, those of least cost first."""
        costs = [self._cost(theta) for theta in starts]
        return [starts[i] for i in np.argsort(costs) if np.isfinite(costs[i])]

    def _starts(self) -> list[Array]:
        """Starting values: what the loop tells, and evenly spread what it does not (Sobol's sequence)."""
        default = self.coordinates.defaults
        read = {"spring.K": max(self.loop.K, 1.0), "spring.F0": self.loop.F0}
        ends = np.log(np.array(list(RANGES.values())))
        places = qmc.Sobol(len(RANGES), scramble=False).random(STARTS)
        found = []
        for place in np.exp(ends[:, 0] + places * (ends[:, 1] - ends[:, 0])):
            values = default | read | dict(zip(RANGES, place.tolist(), strict=True))
            for level in ("lugre.fc", "lugre.fs"):
                values[level] *= self.loop.level
            values["lugre.sigma1"] = 0.5 * np.sqrt(values["lugre.sigma0"] * values["mass.m"])
            found.append(self.coordinates.theta_of(values))
        return found

    def _form(self, tuning: float) -> ResidualForm:
        return ResidualForm(self.h, self.window, tuning)

    def _cost(self, theta: Array) -> float:
        tuning = TUNINGS[-1]
        responses = self.problem.responses(self.problem.start(theta), self._form(tuning))
        if any(r is None for r in responses):
            return float("inf")
        r = np.concatenate([self.problem.residual(i, one) for i, one in enumerate(responses) if one is not None])
        return float(cauchy(r, tuning).sum())

    def _staged(self, theta: Array) -> Solution | None:
        """The end of stages with ever narrower losses."""
        unknowns, found = self.problem.start(theta), None
        bounds = self.coordinates.bounds.padded(len(unknowns))
        for tuning in TUNINGS:
            evaluate = functools.partial(in_windows, self.problem, self._form(tuning))
            found = minimise(evaluate, unknowns, bounds=bounds, iterations=ITERATIONS, tolerance=1e-3)
            if found is None:
                return None
            unknowns, self.evaluations = found.theta, self.evaluations + found.evaluations
        return found


def window(spacing: float) -> float:
    """Seconds in which a free run is set back once, for samples `spacing` [s] apart."""
    return max(WINDOW, FEWEST * spacing)


def told(smooth: Sequence[Experiment], loop: ForcePositionLoop) -> list[Experiment]:
    """The experiments with the samples unseen before which the force is guessed, not known (`GUESSED`)."""
    return [e.with_segments(tuple(replace(s, seen=s.seen & _known(s, loop)) for s in e.segments)) for e in smooth]


def _known(segment: Segment, loop: ForcePositionLoop) -> NDArray[np.bool_]:
    """Whether the force is known [n_samples] since the valve was last set back."""
    bend, m = np.zeros(len(segment.t)), segment.motion
    bend[1:-1] = np.abs(np.diff(segment.u, 2)) / 8
    at = anchors(segment.t, m.crept, m.a, window(segment.dt), loop.load(segment)).at
    stretch = np.searchsorted(at, np.arange(len(segment.t)), side="right")
    worst = np.zeros(len(at) + 1)
    np.maximum.at(worst, stretch, bend)
    return np.asarray(worst[stretch] <= GUESSED * loop.level, bool)


def _parts(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Chunks spread over the experiments, enough to search on, of samples no closer than that needs."""
    total = sum(float(s.t[-1] - s.t[0]) for e in experiments for s in e.segments)
    share = min(1.0, SEARCHED / total)
    every = max(1, int(share * sum(e.samples for e in experiments) / MOST_SAMPLES))
    return [e.with_segments(tuple(c for s in e.segments for c in _chunks(s, share, every))) for e in experiments]


def _chunks(segment: Segment, share: float, every: int) -> list[Segment]:
    n = len(segment.t)
    size = min(n, max(round(CHUNK / segment.dt), FEWEST * every))
    count = max(1, round(share * n / size))
    return [segment.part(at.start, at.stop, every) for at in to_the_ends(n, size if share < 1 else n, count)]
