"""A force-driven fit without starting values where the recorded force is exact: output error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from identification.budget import time_is_over
from identification.data.experiment import Experiment
from identification.data.grid import grids
from identification.estimators.by_order import fit_full, starting_points
from identification.estimators.coordinates import Coordinates
from identification.estimators.fitted import Fit, Outcome, fit_of_free_runs
from identification.estimators.noise_aware.search import UNEXPLAINED
from identification.estimators.output_error.descent import FreeRunDescent, Minimum
from identification.estimators.output_error.starting_values import StartingPoint
from identification.estimators.systematic_error import in_doubt_by
from recordings import Array, Progress, silent
from simulator import Kernel

NEAR, NOISE, CHANCE = 1.0, 1.03, 10.0
"""Mean robust cost of a sample below which an end may be near the truth (0.9 is noise, a slip in the wrong place among
several hundred may double it; from farther off plain squares rarely lead there, and take a minute to show it), and mean
square residual up to which a fit leaves nothing but noise, whose size is known to some percent. Both but for chance: so
much over the square root of the number of samples, for their scatter and that of the estimated noise."""
INTEGRATING_WINDOW = 0.01
"""Reset window [s] for a plant without spring: it integrates every error of the model without limit, so that its free
run says more about the model's smallest flaw than about its parameters."""


def fit_output_error(
    valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], ranked: Sequence[StartingPoint],
    progress: Progress = silent, *, exact: bool,
) -> Fit:  # fmt: skip
    """Fit a valve whose recorded force is exact, by free runs from one start after the other until they explain it.

    The last start is a noise-aware fit. Where free runs do not explain the recordings even from there, that fit is the
    answer if it converged, unless the force is `exact` without doubt. Free runs have a slip in the wrong place then,
    and it allows for errors in the force that there are not: how far they are apart is in its intervals. A plant
    without a spring is set back to the data, and has no other starts than those of the regression.

    ranked : starting values of the regression, the best first.
    """
    window = INTEGRATING_WINDOW if integrates(coordinates) else np.inf
    runs = FreeRuns(FreeRunDescent(valve, coordinates, experiments, window), progress)
    regression = [start.theta for start in ranked]
    if integrates(coordinates):
        return runs.right_from(regression) or runs.best
    starts = starting_points(valve, coordinates, experiments, ranked, progress)

    def first() -> Iterator[Array]:
        yield from regression
        yield from starts.better_ends

    found = runs.right_from(first()) or runs.right_from(starts.better_regression)
    if found is not None or time_is_over():
        return found or runs.best
    progress("one more fit, with error in the force", 0, 0)
    noisy = fit_full(valve, coordinates, experiments, grids(experiments), starts, progress)
    estimate = noisy.estimate
    found = runs.right_from([] if estimate is None or estimate.loss > UNEXPLAINED else [estimate.theta])
    if found is not None:
        return found
    if exact or not (noisy.outcome is Outcome.CONVERGED or (noisy.outcome.usable and not runs.ends)):
        return runs.best
    return in_doubt_by(noisy, runs.best_end.unknowns[: coordinates.n_free]) if runs.best_end else noisy


class FreeRuns:
    """The fits by free runs of whole recordings. ends : of the robust stage, one for every list of starts that led
    anywhere, refined; fits : of those that were near.
    """

    def __init__(self, descent: FreeRunDescent, progress: Progress = silent) -> None:
        self.descent, self.progress = descent, progress
        self.ends, self.fits = list[Minimum](), list[Fit]()
        chance = CHANCE / np.sqrt(descent.full.samples)
        self.near, self.noise = NEAR + chance, NOISE + chance

    def right_from(self, starts: Iterable[Array]) -> Fit | None:
        """The fit from the first of some starts (n_free,) that leads near the truth, if it converges and leaves nothing
        but noise. One that has a slip in the wrong place leaves a little more, or does not settle, and its values are
        wrong by many standard deviations.
        """
        if self.ends and time_is_over():
            return None
        end = self.descent.refined(self._minimum(starts))
        if end is None:
            return None
        self.ends.append(end)
        if end.level >= self.near:
            return None
        found = self._fit(end)
        self.fits.append(found)
        return found if found.outcome is Outcome.CONVERGED and found.rms**2 < self.noise else None

    @property
    def best(self) -> Fit:
        """The best of the fits; where there is none, what plain squares make of the best end."""
        if self.fits:
            return min(self.fits, key=lambda fit: (fit.outcome is not Outcome.CONVERGED, fit.rms))
        return self._fit(self.best_end)

    @property
    def best_end(self) -> Minimum | None:
        """The end of least cost."""
        return min(self.ends, key=lambda end: end.level, default=None)

    def _minimum(self, starts: Iterable[Array]) -> Minimum | None:
        """The end of the robust stage with the least cost, from one start after the other until it is near."""
        best: Minimum | None = None
        for attempt, theta in enumerate(starts, 1):
            self.progress("search", attempt, 0)
            end = self.descent.follow(theta)
            if end is not None and (best is None or end.level < best.level):
                best = end
            if best is not None and (best.level < self.near or time_is_over()):
                break
        return best

    def _fit(self, end: Minimum | None) -> Fit:
        """The fit by plain least squares from a refined end."""
        self.progress("fit to whole recordings", 0, 0)
        problem, polished = self.descent.full, None if end is None else self.descent.polish(end)
        return fit_of_free_runs(problem.kernel, problem.coordinates, problem, polished)


def integrates(coordinates: Coordinates) -> bool:
    """Whether the plant has no spring, so that its position is an integral."""
    return coordinates.held("spring.K") == 0.0
