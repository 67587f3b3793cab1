"""A force-driven fit where the recorded force is noisy: when that matters, and the way from starts to a fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from identification.data.experiment import Experiment
from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from identification.estimators.fitted import Fit, Outcome, fit_of, free_run_start
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.resolution import resolved_by_nodes
from identification.estimators.noise_aware.search import (
    UNEXPLAINED,
    best_on_chunks,
    from_both_sides,
    on_whole_recordings,
)
from identification.estimators.order import Order
from identification.estimators.output_error.descent import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.starting_values import regression
from identification.estimators.systematic_error import without_bias
from recordings import Array, Progress, silent
from simulator import Kernel, kernel

MATTERS = 1e-4
"""Noise of the force, as a share of Coulomb friction, from which it is not neglected. Noise shakes the simulated
bristle by its share of the break-away deflection in every sample: 0.2 % of it spoils break-away force by 30 %, and 0.02
to 0.03 % the spring constant by eight standard deviations."""


def force_noise_matters(experiments: Sequence[Experiment]) -> bool:
    """Whether the noise of the recorded force is large enough to disturb a simulated bristle."""
    rough = regression(experiments)
    noise = max(e.noise_force for e in experiments)
    return rough is not None and noise > MATTERS * abs(rough["fc"])


def fit_noise_aware(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], segment_grids: Sequence[Grid],
    starts: Sequence[Array], order: Order, progress: Progress = silent, *,
    better: Iterable[Array] = (), told: bool = True, shows_slips: bool = True,
) -> Fit:  # fmt: skip
    """Fit a valve whose recorded force is noisy, in full or in damped order, from starting values.

    smooth : the experiments, with a smooth force; segment_grids : of the experiments; starts (m,) : the likeliest
    first; better : what can be made of them, each when it is its turn, for the first one is mostly enough; told :
    whether the order is asked for, or may become full where the search finds a swing that nodes between samples
    resolve: starting values may be too stiff; shows_slips : whether samples show the course of a slip.
    """
    problem = Problem(kernel(valve.effects, "force", valve.catalogue, damped=order == "damped"), coordinates, smooth)

    def is_resolved(end: Estimate) -> bool:
        if told or order == "full" or end.loss > UNEXPLAINED:  # what explains nothing says nothing of the swing
            return False
        return resolved_by_nodes(coordinates.values(end.theta), problem.spacing)

    work = noise_aware_for(valve, coordinates, segment_grids, starts, order)
    best = best_on_chunks(work, better or starts, is_resolved, progress)
    if best is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    if is_resolved(best):
        return fit_noise_aware(valve, coordinates, smooth, segment_grids, [best.theta], "full", progress)
    progress("fit to whole recordings", 0, 0)
    whole = on_whole_recordings(noise_aware_for(valve, coordinates, segment_grids, [best.theta], order), best)
    if whole is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    if whole.explains and not (whole.is_root or shows_slips):  # costs differ little between slips that are jumps
        whole = from_both_sides(whole)
    work, estimate = whole.work, whole.end
    minimum = Minimum(
        free_run_start(problem, estimate), estimate.normal, ResidualForm(work.freedom.h_max), 0, estimate.settled
    )  # fmt: skip
    found = replace(fit_of(estimate, work, problem, minimum), order=order)
    if whole.explains:
        return without_bias(replace(found, outcome=Outcome.CONVERGED), whole)
    return replace(found, outcome=Outcome.NOT_SETTLED) if found.outcome is Outcome.CONVERGED else found
