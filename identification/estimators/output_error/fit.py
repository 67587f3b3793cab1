"""A force-driven fit without starting values where the recorded force is exact: output error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.budget import time_is_over
from identification.data.experiment import Experiment
from identification.data.grid import grids
from identification.estimators.by_order import fit_full
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import CLEAN_LOSS
from identification.estimators.fitted import Fit, Outcome, fit_of_free_runs
from identification.estimators.noise_aware.search import UNEXPLAINED
from identification.estimators.output_error.basin_search import basin_search
from identification.estimators.output_error.homotopy import Homotopy, Minimum
from identification.estimators.output_error.starting_values import StartingPoint
from recordings import Array, Progress, silent
from simulator import Kernel

TRIES = 4
"""Starts that are followed at most."""
WORTH = 0.98
"""A further start is tried only while the last one brought the cost below this share of the best before it."""
GOOD_ENOUGH = 1.15
"""Normalised root mean square residual at which no further start is tried."""

INTEGRATING_WINDOW = 0.01
"""Reset window [s] of the last stage for a plant without spring: it integrates every error of the model without limit,
so that its free run says more about the model's smallest flaw than about its parameters."""


def fit_output_error(
    valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], ranked: Sequence[StartingPoint],
    progress: Progress = silent, *, exact: bool,
) -> Fit:  # fmt: skip
    """Fit a valve whose recorded force is exact, from starting values, best first. Where free runs diverge, or do not
    explain the recordings, and a noise-aware fit does, that is the answer, unless the force is `exact` without doubt.
    """
    window = INTEGRATING_WINDOW if integrates(coordinates) else np.inf
    homotopy = Homotopy(valve, coordinates, experiments, window)
    best = _best_minimum(homotopy, ranked, progress)
    progress("fit to whole recordings", 0, 0)
    found = fit_of_free_runs(valve, coordinates, homotopy.full, _polished(homotopy, best))
    if found.outcome is Outcome.NOT_EXPLAINED or explains(found) or integrates(coordinates):
        return found
    progress("one more fit, with error in the force", 0, 0)
    noisy = fit_full(valve, coordinates, experiments, grids(experiments), ranked, progress)
    if noisy.outcome is Outcome.CONVERGED and not exact:
        return noisy
    if noisy.estimate is None or noisy.estimate.loss > UNEXPLAINED or time_is_over():
        return found
    end = _polished(homotopy, homotopy.follow(noisy.estimate.theta))
    other = fit_of_free_runs(valve, coordinates, homotopy.full, end)
    return other if other.rms < found.rms or found.outcome is Outcome.DIVERGED else found


def explains(found: Fit) -> bool:
    """Whether a fit by free runs leaves nothing but noise. One that has a slip in the wrong place leaves a little more,
    and its values are wrong by many standard deviations.
    """
    return found.problem is not None and found.rms**2 < CLEAN_LOSS + 3 / np.sqrt(found.problem.samples)


def integrates(coordinates: Coordinates) -> bool:
    """Whether the plant has no spring, so that its position is an integral."""
    return coordinates.held("spring.K") == 0.0


def _best_minimum(homotopy: Homotopy, ranked: Sequence[StartingPoint], progress: Progress) -> Minimum | None:
    """The end of the robust stages with the least cost, from one start after the other while that helps."""
    best: Minimum | None = None
    for attempt in range(TRIES):
        progress("search", attempt, TRIES)
        theta = _next_start(attempt, ranked, best, homotopy)
        minimum = None if theta is None else homotopy.follow(theta)
        stuck = minimum is None or (best is not None and minimum.level > WORTH * best.level)
        if minimum is not None and (best is None or minimum.level < best.level):
            best = minimum
        reached = best is not None and np.sqrt(best.level) < GOOD_ENOUGH
        if reached or (attempt > 1 and stuck) or (best is not None and time_is_over()):
            break
    return best


def _next_start(
    attempt: int, ranked: Sequence[StartingPoint], best: Minimum | None, homotopy: Homotopy
) -> Array | None:
    """The best start first; then the end of a basin search from the best minimum; then those from other starts."""
    if attempt == 1 and best is not None:
        return basin_search(best.unknowns[: homotopy.full.n_free], homotopy)
    place = max(attempt - 1, 0)
    if place >= len(ranked):
        return None
    return ranked[0].theta if attempt == 0 else basin_search(ranked[place].theta, homotopy)


def _polished(homotopy: Homotopy, minimum: Minimum | None) -> Minimum | None:
    """A minimum on whole recordings by plain least squares."""
    whole = None if minimum is None else homotopy.carried(minimum)
    return None if whole is None else homotopy.polish(whole)
