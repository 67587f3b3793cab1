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
from identification.estimators.output_error.descent import FreeRunDescent, Minimum
from identification.estimators.output_error.starting_values import StartingPoint
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
    """Fit a valve whose recorded force is exact. Where free runs diverge, or do not explain the recordings, they go on
    from a noise-aware fit. Where they do not explain them even then, that fit is the answer if it converged, unless the
    force is `exact` without doubt. A plant without a spring is set back to the data, and has no noise-aware fit.

    ranked : starting values, the best first; those that runs in windows give are tried after them.
    """
    window = INTEGRATING_WINDOW if integrates(coordinates) else np.inf
    descent = FreeRunDescent(valve, coordinates, experiments, window)

    @functools.cache
    def starts() -> Starts:
        return starting_points(valve, coordinates, experiments, ranked, progress)

    def candidates() -> Iterator[Array]:
        yield from (start.theta for start in ranked)
        if not integrates(coordinates):
            yield from starts().narrowed_ends

    best = descent.refined(_best_minimum(descent, candidates(), progress))
    if integrates(coordinates) or (best is not None and time_is_over()):
        return _free_runs(descent, best, progress)
    found = _free_runs(descent, best, progress) if _is_near(descent, best) else None
    if found is not None and (_is_right(descent, found) or time_is_over()):
        return found
    progress("one more fit, with error in the force", 0, 0)
    noisy = fit_full(valve, coordinates, experiments, grids(experiments), starts(), progress)
    known = None if noisy.estimate is None or noisy.estimate.loss > UNEXPLAINED else noisy.estimate.theta
    further = None if known is None or time_is_over() else descent.refined(descent.follow(known))
    last = _free_runs(descent, further, progress) if _is_near(descent, further) else None
    if last is not None and _is_right(descent, last):
        return last
    ends = [end for end in (best, further) if end is not None]
    if not exact and (noisy.outcome is Outcome.CONVERGED or (noisy.outcome.usable and not ends)):
        return noisy
    fits = [fit for fit in (found, last) if fit is not None]
    if not fits:
        return _free_runs(descent, min(ends, key=lambda end: end.level, default=None), progress)
    return min(fits, key=lambda fit: (fit.outcome is not Outcome.CONVERGED, fit.rms))


def _is_near(descent: FreeRunDescent, end: Minimum | None) -> bool:
    """Whether an end of the robust stage may be near the truth."""
    return end is not None and end.level < NEAR + CHANCE / np.sqrt(descent.full.samples)


def _is_right(descent: FreeRunDescent, found: Fit) -> bool:
    """Whether a fit by free runs has converged, and leaves nothing but noise. One that has a slip in the wrong place
    leaves a little more, or does not settle, and its values are wrong by many standard deviations.
    """
    most = NOISE + CHANCE / np.sqrt(descent.full.samples)
    return found.outcome is Outcome.CONVERGED and bool(found.rms**2 < most)


def integrates(coordinates: Coordinates) -> bool:
    """Whether the plant has no spring, so that its position is an integral."""
    return coordinates.held("spring.K") == 0.0


def _best_minimum(descent: FreeRunDescent, starts: Iterable[Array], progress: Progress) -> Minimum | None:
    """The end of the robust stage with the least cost, from one start (n_free,) after the other until it is near."""
    best: Minimum | None = None
    for attempt, theta in enumerate(starts, 1):
        progress("search", attempt, 0)
        minimum = descent.follow(theta)
        if minimum is not None and (best is None or minimum.level < best.level):
            best = minimum
        if _is_near(descent, best) or (best is not None and time_is_over()):
            break
    return best


def _free_runs(descent: FreeRunDescent, minimum: Minimum | None, progress: Progress) -> Fit:
    """The fit by free runs of whole recordings, by plain least squares from a refined minimum."""
    progress("fit to whole recordings", 0, 0)
    problem = descent.full
    polished = None if minimum is None else descent.polish(minimum)
    return fit_of_free_runs(problem.kernel, problem.coordinates, problem, polished)
