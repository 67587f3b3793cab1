"""A force-driven fit without starting values where the recorded force is exact: output error."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from identification.budget import time_is_over
from identification.data.experiment import Experiment
from identification.data.grid import grids
from identification.estimators.by_order import Starts, fit_full, starting_points
from identification.estimators.coordinates import Coordinates
from identification.estimators.fitted import CHANCE, Fit, Outcome, fit_of_free_runs
from identification.estimators.noise_aware.search import SAME, UNEXPLAINED
from identification.estimators.output_error.descent import FreeRunDescent, Minimum
from identification.estimators.output_error.starting_values import StartingPoint
from identification.estimators.systematic_error import in_doubt_by
from recordings import Array, Progress, silent
from simulator import Kernel

NEAR, NOISE = 1.0, 1.03
"""Mean robust cost of a sample below which an end may be near the truth (0.9 is noise, a slip in the wrong place among
several hundred may double it; from farther off plain squares rarely lead there, and take a minute to show it), and mean
square residual up to which a fit leaves nothing but noise, whose size is known to some percent. Both but for `CHANCE`.
"""
INTEGRATING_WINDOW = 0.01
"""Reset window [s] for a plant without spring: it integrates every error of the model without limit, so that its free
run says more about the model's smallest flaw than about its parameters."""


def fit_output_error(
    valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], ranked: Sequence[StartingPoint],
    progress: Progress = silent, *, exact: bool,
) -> Fit:  # fmt: skip
    """Fit a valve whose recorded force is exact, by free runs from one group of starts after the other until they
    explain it: what the regression tells, with what runs in windows find; what these make of the regression's starts;
    and a noise-aware fit.

    Where free runs do not explain the recordings even from there, the noise-aware fit is the answer if it converged, or
    they led nowhere, unless the force is `exact` without doubt. It allows for errors in the force and free runs do not:
    how far they are apart is in its intervals. A plant without a spring is set back to the data, and has the starts of
    the regression only.

    ranked : starting values of the regression, the best first.
    """
    window = INTEGRATING_WINDOW if integrates(coordinates) else np.inf
    runs = FreeRuns(FreeRunDescent(valve, coordinates, experiments, window), progress)
    regression = [start.theta for start in ranked]
    if integrates(coordinates):
        return runs.right_from(regression) or runs.best

    @functools.cache
    def starts() -> Starts:
        return starting_points(valve, coordinates, experiments, ranked, progress)

    def first() -> Iterator[Array]:
        yield from regression
        yield from starts().better_ends

    def second() -> Iterator[Array]:
        yield from starts().better_regression

    found = runs.right_from(first()) or runs.right_from(second())
    if found is not None or (runs.led_anywhere and time_is_over()):
        return found or runs.best
    progress("one more fit, with error in the force", 0, 0)
    noisy = fit_full(valve, coordinates, experiments, grids(experiments), starts(), progress)
    estimate = noisy.estimate
    if estimate is not None and estimate.loss <= UNEXPLAINED and not time_is_over():
        found = runs.right_from([estimate.theta], np.inf)
        if found is not None:
            return found
    if exact or noisy.outcome is not Outcome.CONVERGED:
        best = runs.best
        return noisy if noisy.outcome.usable and not (exact or best.outcome.usable) else best
    other = runs.best_end
    return noisy if other is None else in_doubt_by(noisy, other.unknowns[: coordinates.n_free])


class FreeRuns:
    """The fits by free runs of whole recordings. ends : of the robust stage, refined; far : those that explain
    nothing on chunks, which are only refined where nothing else is left; fits : of the ends that are near.
    """

    def __init__(self, descent: FreeRunDescent, progress: Progress = silent) -> None:
        self.descent, self.progress = descent, progress
        self.ends, self.far, self.fits = list[Minimum](), list[Minimum](), list[Fit]()
        self._tried = list[Array]()
        chance = CHANCE / np.sqrt(descent.full.samples)
        self.near, self.noise = NEAR + chance, NOISE + chance

    def right_from(self, starts: Iterable[Array], most: float = UNEXPLAINED) -> Fit | None:
        """The first fit that is right from some starts (n_free,): of every end near the truth, then of the best of the
        others, if its level is below `most`. The sub-step of the robust stage may move slips: a right end leaves up to
        2.8 then.
        """
        if self.led_anywhere and time_is_over():
            return None
        best: Minimum | None = None
        for attempt, theta in enumerate(starts, 1):
            self.progress("search", attempt, 0)
            end = self.descent.follow(theta)
            if end is not None and end.level < self.near:
                found = self._right(end)
                if found is not None:
                    return found
            elif end is not None and (best is None or end.level < best.level):
                best = end
            if time_is_over() and (best is not None or self.led_anywhere):
                break
        if best is not None and best.level > most:
            self.far.append(best)
            return None
        return None if best is None or (self.ends and time_is_over()) else self._right(best)

    def _is_known(self, end: Minimum) -> bool:
        """Whether an end of the robust stage was looked at before."""
        theta = end.unknowns[: self.descent.full.n_free]
        known = any(np.abs(theta - one).max() < SAME for one in self._tried)
        self._tried.append(theta)
        return known

    def _right(self, end: Minimum) -> Fit | None:
        """The fit from an end of the robust stage, if it converges and leaves nothing but noise. One that has a slip in
        the wrong place leaves a little more, or does not settle, and is wrong by many standard deviations.
        """
        refined = None if self._is_known(end) else self.descent.refined(end)
        if refined is None:
            return None
        self.ends.append(refined)
        if refined.level >= self.near:
            return None
        found = self._fit(refined)
        self.fits += [found] if found.outcome.usable else []
        return found if found.outcome is Outcome.CONVERGED and found.rms**2 < self.noise else None

    @property
    def best(self) -> Fit:
        """The best of the fits; where there is none, what plain squares make of the best end."""
        if self.fits:
            return min(self.fits, key=lambda fit: (fit.outcome is not Outcome.CONVERGED, fit.rms))
        return self._fit(self.best_end)

    @property
    def led_anywhere(self) -> bool:
        """Whether there is an end, near or far."""
        return bool(self.ends or self.far)

    @property
    def best_end(self) -> Minimum | None:
        """The end of least cost; where all are far, the first of them that whole recordings lead anywhere."""
        if self.ends:
            return min(self.ends, key=lambda end: end.level)
        refined = map(self.descent.refined, sorted(self.far, key=lambda end: end.level))
        return next((end for end in refined if end is not None), None)

    def _fit(self, end: Minimum | None) -> Fit:
        """The fit by plain least squares from a refined end."""
        self.progress("fit to whole recordings", 0, 0)
        problem, polished = self.descent.full, None if end is None else self.descent.polish(end)
        return fit_of_free_runs(problem.kernel, problem.coordinates, problem, polished)


def integrates(coordinates: Coordinates) -> bool:
    """Whether the plant has no spring, so that its position is an integral."""
    return coordinates.held("spring.K") == 0.0
