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
from identification.estimators.fitted import Fit, Outcome, fit_of_free_runs
from identification.estimators.noise_aware.search import UNEXPLAINED
from identification.estimators.output_error.homotopy import Homotopy, Minimum
from identification.estimators.output_error.starting_values import StartingPoint
from recordings import Array, Progress, silent
from simulator import Kernel

NEAR = 1.0
"""Mean robust cost of a sample below which an end may be near the truth: 0.9 is noise, a slip in the wrong place among
several hundred may double it. From farther off plain squares rarely lead there, and take a minute to show it."""

NOISE = 1.1
"""Mean square residual up to which a fit leaves nothing but noise, whose size is known to some percent."""

INTEGRATING_WINDOW = 0.01
"""Reset window [s] of the last stage for a plant without spring: it integrates every error of the model without limit,
so that its free run says more about the model's smallest flaw than about its parameters."""


def fit_output_error(
    valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], ranked: Sequence[StartingPoint],
    progress: Progress = silent, *, exact: bool,
) -> Fit:  # fmt: skip
    """Fit a valve whose recorded force is exact. Where free runs diverge, or do not explain the recordings, they go on
    from a noise-aware fit. What that ends with is the answer where free runs do not explain the recordings even then,
    unless the force is `exact` without doubt.

    ranked : starting values, the best first; those that runs in windows give are tried after them.
    """
    window = INTEGRATING_WINDOW if integrates(coordinates) else np.inf
    homotopy = Homotopy(valve, coordinates, experiments, window)

    @functools.cache
    def starts() -> Starts:
        return starting_points(valve, coordinates, experiments, ranked, progress)

    def candidates() -> Iterator[Array]:
        yield from (start.theta for start in ranked)
        if not integrates(coordinates):
            yield from starts().narrowed_ends

    best = homotopy.refined(_best_minimum(homotopy, candidates(), progress))
    if integrates(coordinates):
        return _free_runs(homotopy, best, progress)
    found = _right(homotopy, best, progress)
    if found is not None:
        return found
    progress("one more fit, with error in the force", 0, 0)
    noisy = fit_full(valve, coordinates, experiments, grids(experiments), starts(), progress)
    known = None if noisy.estimate is None or noisy.estimate.loss > UNEXPLAINED else noisy.estimate.theta
    further = None if known is None or time_is_over() else homotopy.refined(homotopy.follow(known))
    found = _right(homotopy, further, progress)
    if found is not None:
        return found
    if noisy.outcome is Outcome.CONVERGED and not exact:
        return noisy
    ends = [end for end in (best, further) if end is not None]
    return _free_runs(homotopy, min(ends, key=lambda end: end.level, default=None), progress)


def _is_near(end: Minimum | None) -> bool:
    """Whether an end of the robust stage may be near the truth."""
    return end is not None and end.level < NEAR


def _right(homotopy: Homotopy, end: Minimum | None, progress: Progress) -> Fit | None:
    """The fit by free runs from an end, where that converges, and leaves nothing but noise; None elsewhere. One that
    has a slip in the wrong place leaves a little more, or does not settle, and its values are wrong by many standard
    deviations.
    """
    if not _is_near(end):
        return None
    found = _free_runs(homotopy, end, progress)
    return found if found.outcome is Outcome.CONVERGED and found.rms**2 < NOISE else None


def integrates(coordinates: Coordinates) -> bool:
    """Whether the plant has no spring, so that its position is an integral."""
    return coordinates.held("spring.K") == 0.0


def _best_minimum(homotopy: Homotopy, starts: Iterable[Array], progress: Progress) -> Minimum | None:
    """The end of the robust stage with the least cost, from one start (n_free,) after the other until it is near."""
    best: Minimum | None = None
    for attempt, theta in enumerate(starts, 1):
        progress("free runs of chunks", attempt, 0)
        minimum = homotopy.follow(theta)
        if minimum is not None and (best is None or minimum.level < best.level):
            best = minimum
        if _is_near(best) or (best is not None and time_is_over()):
            break
    return best


def _free_runs(homotopy: Homotopy, minimum: Minimum | None, progress: Progress) -> Fit:
    """The fit by free runs of whole recordings, by plain least squares from a refined minimum."""
    progress("fit to whole recordings", 0, 0)
    problem = homotopy.full
    polished = None if minimum is None else homotopy.polish(minimum)
    return fit_of_free_runs(problem.kernel, problem.coordinates, problem, polished)
