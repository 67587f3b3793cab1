"""A force-driven fit without starting values where the recorded force is noisy, or the sampling does not resolve the
bristle: when it is needed, and from where on.

Starting values come from output error on the smoothed force (`output_error/window_search.py`); the search on chunks
leads from there to whole recordings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.data.experiment import Experiment
from identification.data.grid import Grid, grids, with_smooth_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from identification.estimators.fitted import FREE_STEP, Fit, Outcome, fit_of
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.linearised_model import PathFreedom
from identification.estimators.noise_aware.resolution import quickest, resolving
from identification.estimators.noise_aware.search import UNEXPLAINED, best_on_chunks, on_whole_recordings
from identification.estimators.order import Order, sub_step
from identification.estimators.output_error.force_position_loop import force_position_loop
from identification.estimators.output_error.homotopy import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.starting_values import regression, starting_values
from identification.estimators.output_error.window_search import WindowSearch
from recordings import Array, Progress, silent
from simulator import Kernel, kernel

MATTERS = 3e-4
"""Noise of the force, as a share of Coulomb friction, from which it is not neglected. Noise shakes the simulated
bristle by its share of the break-away deflection in every sample, and 0.2 % of it spoils break-away force by 30 %."""
FINER = 4
"""Part of the longest sub-step that resolves a slip which a fit of damped order takes: the step's own error biases
mass and viscous friction by more than the noise does (at full size by ten standard deviations, at a quarter by none
that shows)."""
DAMPED = PathFreedom(1.0, 1e-4, 0.1)
"""Freedom of the path in damped order."""


def force_noise_matters(experiments: Sequence[Experiment]) -> bool:
    """Whether the noise of the recorded force is large enough to disturb a simulated bristle."""
    rough = regression(experiments)
    noise = max(e.noise_force for e in experiments)
    return rough is not None and noise > MATTERS * abs(rough["fc"])


def noise_aware_for(
    valve: Kernel, coordinates: Coordinates, segment_grids: Sequence[Grid], starts: Sequence[Array], order: Order
) -> NoiseAware:
    """The estimator for the grids of some experiments: in full order with nodes that resolve what the starting values
    say, in damped order with sub-steps that resolve a slip.
    """
    with_error = kernel(valve.effects, "force with error", valve.catalogue, damped=order == "damped")
    if order == "damped":
        freedom = replace(DAMPED, h_max=sub_step(coordinates.values(starts[0])) / FINER)
        return NoiseAware(with_error, coordinates, segment_grids, freedom)
    return NoiseAware(with_error, coordinates, resolving(segment_grids, quickest(coordinates, starts[:1])))


def fit_noise_aware(
    valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], segment_grids: Sequence[Grid],
    order: Order = "full", progress: Progress = silent,
) -> Fit:  # fmt: skip
    """Fit a valve whose recorded force is noisy, without starting values; segment_grids : of the experiments."""
    smooth = with_smooth_force(experiments, segment_grids)
    starts = starts_on_smooth_force(valve, coordinates, smooth, progress)
    if not starts:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    work = noise_aware_for(valve, coordinates, segment_grids, starts, order)
    best = best_on_chunks(work, starts, progress)
    progress("fit to whole recordings", 0, 0)
    work = work if best is None else noise_aware_for(valve, coordinates, segment_grids, [best.theta], order)
    estimate = None if best is None else on_whole_recordings(work, best)
    if estimate is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    model = kernel(valve.effects, "force", valve.catalogue, damped=order == "damped")
    problem = Problem(model, coordinates, smooth)
    form = ResidualForm(work.freedom.h_max if order == "damped" else FREE_STEP)
    minimum = Minimum(_free_run_start(problem, estimate), estimate.normal, form, 0, estimate.settled)
    return replace(fit_of(estimate, work, problem, minimum), order=order)


def starts_on_smooth_force(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], progress: Progress = silent
) -> list[Array]:
    """Starting values (m,), the best first, from experiments with a smooth force; none where nothing moves."""
    loop = force_position_loop(smooth, coordinates.held("spring.K"))
    if loop is not None:
        model = kernel(valve.effects, "force", valve.catalogue, damped=True)
        ends = WindowSearch(model, coordinates, smooth, loop).ends(progress)
        if ends:
            return [end.theta[: coordinates.n_free] for end in ends]
    return [start.theta for start in starting_values(smooth, valve, coordinates)]


def start_of_free_runs(valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]) -> Array | None:
    """Starting values (m,) for output error, from a fit to chunks whose paths may stray: costly, but it finds its way
    where resets to the data do not. None where it leads nowhere, as with a model that lacks something.
    """
    starts = starts_on_smooth_force(valve, coordinates, experiments)
    if not starts:
        return None
    end = best_on_chunks(noise_aware_for(valve, coordinates, grids(experiments), starts, "full"), starts)
    return None if end is None or end.loss > UNEXPLAINED else end.theta


def _free_run_start(problem: Problem, estimate: Estimate) -> Array:
    """Unknowns of free runs that start where the smoothed paths do."""
    local = [
        path[0, problem.local] / problem.local_scale(piece)
        for piece, path in zip(problem.pieces, estimate.paths, strict=True)
    ]
    return np.concatenate([estimate.theta, *local])
