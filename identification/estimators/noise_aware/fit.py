"""A force-driven fit without starting values where the recorded force is noisy: when it is needed, and from where on.

Starting values come from output error on the smoothed force (`output_error/starting_values.py`, `basin_search.py`); the
search on chunks leads from there to whole recordings.
"""

from __future__ import annotations

from collections.abc import Sequence

from identification.data.experiment import Experiment
from identification.data.grid import Grid, grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.fitted import FREE_STEP, Fit, Outcome, fit_of, free_run_start
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.resolution import quickest, resolving
from identification.estimators.noise_aware.search import UNEXPLAINED, best_on_chunks, on_chunks, on_whole_recordings
from identification.estimators.output_error.basin_search import basin_search
from identification.estimators.output_error.homotopy import Homotopy, Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.starting_values import regression, starting_values
from recordings import Array, Progress, silent
from simulator import Kernel, kernel

MATTERS = 1e-4
"""Noise of the force, as a share of Coulomb friction, from which it is not neglected. Noise shakes the simulated
bristle by its share of the break-away deflection in every sample: 0.2 % of it spoils break-away force by 30 %, and 0.02
to 0.03 % the spring constant by eight standard deviations."""
TRIES_FOR_FREE_RUNS = 3
"""Descents on chunks at most that seek starting values for output error."""


def force_noise_matters(experiments: Sequence[Experiment]) -> bool:
    """Whether the noise of the recorded force is large enough to disturb a simulated bristle."""
    rough = regression(experiments)
    noise = max(e.noise_force for e in experiments)
    return rough is not None and noise > MATTERS * abs(rough["fc"])


def noise_aware_for(
    valve: Kernel, coordinates: Coordinates, segment_grids: Sequence[Grid], starts: Sequence[Array]
) -> NoiseAware:
    """The estimator for the grids of some experiments, with nodes that resolve what the starting values say."""
    with_error = kernel(valve.effects, "force with error", valve.catalogue)
    return NoiseAware(with_error, coordinates, resolving(segment_grids, quickest(coordinates, starts)))


def fit_noise_aware(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], segment_grids: Sequence[Grid],
    starts: Sequence[Array] = (), progress: Progress = silent,
) -> Fit:  # fmt: skip
    """Fit a valve whose recorded force is noisy. smooth : the experiments, with a smooth force; segment_grids : of the
    experiments; starts : starting values (m,), the best first, where they are known.
    """
    progress("starting values", 0, 0)
    starts = starts or smoothed_starts(valve, coordinates, smooth)
    if not starts:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    whole = noise_aware_for(valve, coordinates, segment_grids, starts)
    chunks = on_chunks(whole)
    best = best_on_chunks(chunks, starts, progress=progress)
    progress("fit to whole recordings", 0, 0)
    estimate = None if best is None else on_whole_recordings(whole, chunks, best)
    if estimate is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    problem = Problem(valve, coordinates, smooth)
    unknowns = free_run_start(problem, estimate)
    minimum = Minimum(unknowns, estimate.normal, ResidualForm(FREE_STEP), 0, estimate.settled)
    return fit_of(estimate, whole, problem, minimum)


def smoothed_starts(valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment]) -> list[Array]:
    """Starting values (m,), the best first, from experiments with a smooth force; none where nothing moves."""
    ranked = starting_values(smooth, valve, coordinates)
    if not ranked:
        return []
    first = basin_search(ranked[0].theta, Homotopy(valve, coordinates, smooth))
    return [theta for theta in (first, ranked[0].theta) if theta is not None]


def start_of_free_runs(valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]) -> Array | None:
    """Starting values (m,) for output error, from a fit to chunks whose paths may stray: costly, but it finds its way
    where resets to the data do not. None where it leads nowhere, as with a model that lacks something.
    """
    starts = smoothed_starts(valve, coordinates, experiments)
    if not starts:
        return None
    whole = noise_aware_for(valve, coordinates, grids(experiments), starts)
    end = best_on_chunks(on_chunks(whole), starts, most=TRIES_FOR_FREE_RUNS)
    return None if end is None or end.loss > UNEXPLAINED else end.theta
