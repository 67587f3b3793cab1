"""The fit in damped order: by runs that are set back to the data, and with the force estimated where that converges.

Runs in windows find their way from nothing but the loop of force over position, at any sampling. Where the force is
noisy the noise-aware estimate goes on from there: it tells friction many times better. Where a slip is a jump between
samples far apart its paths may not find every slip; then runs in windows go on from its end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.data.experiment import Experiment
from identification.data.grid import Grid, grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from identification.estimators.fitted import Fit, Outcome, fit_of, free_run_start
from identification.estimators.noise_aware.damped import best_on_chunks, damped_for, on_whole_recordings
from identification.estimators.noise_aware.fit import fit_noise_aware
from identification.estimators.noise_aware.resolution import RESOLVED_BY_NODES
from identification.estimators.order import Order, slip_is_seen, turn
from identification.estimators.output_error.damped import fit_in_windows, search_for
from identification.estimators.output_error.homotopy import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.replicates import replicate_without_noise
from recordings import Array, Progress, silent
from simulator import Kernel, kernel

STEPS = 2
"""Steps of the fit to what the model gives in full order."""


def fit_damped(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], order: Order = "damped",
    segment_grids: Sequence[Grid] = (), progress: Progress = silent, *, told: bool = True,
) -> Fit:  # fmt: skip
    """Fit a valve whose sampling does not resolve the bristle, without starting values.

    smooth : the experiments, with a smooth force; order : ``damped``, or ``static`` where no slip is resolved;
    segment_grids : of the experiments, where the recorded force is noisy; told : whether the order is asked for, or may
    become full where the search finds a swing that nodes between samples resolve: starting values may be too stiff.
    """
    progress("starting values", 0, 0)
    search = search_for(valve, coordinates, smooth, order)
    if search is None:
        return Fit(Outcome.TOO_SHORT, valve, coordinates)
    starts = [end.theta[: coordinates.n_free] for end in search.ends(progress)]
    found = None
    if segment_grids and order == "damped":
        found = _noise_aware(valve, coordinates, smooth, segment_grids, starts, progress, told)
    if found is None:
        return fit_in_windows(search, starts, order, progress)
    if found.order == "full" or found.outcome is Outcome.CONVERGED or _sees_slips(found):
        return found
    assert found.estimate is not None
    in_windows = fit_in_windows(search, [found.estimate.theta], order, progress)
    return in_windows if in_windows.outcome is Outcome.CONVERGED else found


def _sees_slips(found: Fit) -> bool:
    """Whether the course of slips shows, so that the noise-aware estimate explains what is a valve of this kind."""
    return found.problem is not None and slip_is_seen(found.values, found.problem.spacing)


def _noise_aware(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], segment_grids: Sequence[Grid],
    starts: Sequence[Array], progress: Progress, told: bool,
) -> Fit | None:  # fmt: skip
    """The noise-aware fit from some starting values (m,), the likeliest first, in full order where they lead to a swing
    that nodes resolve; None where the model diverges from all.
    """
    if not starts:
        return None
    problem = Problem(kernel(valve.effects, "force", valve.catalogue, damped=True), coordinates, smooth)

    def is_resolved(end: Estimate) -> bool:
        return not told and turn(coordinates.values(end.theta), problem.spacing) < RESOLVED_BY_NODES

    best = best_on_chunks(damped_for(valve, coordinates, segment_grids, starts[0]), starts, is_resolved, progress)
    if best is None:
        return None
    if is_resolved(best):
        return fit_noise_aware(valve, coordinates, smooth, segment_grids, [best.theta], progress)
    progress("fit to whole recordings", 0, 0)
    work = damped_for(valve, coordinates, segment_grids, best.theta)
    estimate = on_whole_recordings(work, best.theta)
    if estimate is None:
        return None
    form = ResidualForm(work.freedom.h_max)
    minimum = Minimum(free_run_start(problem, estimate), estimate.normal, form, 0, estimate.settled)
    found = replace(fit_of(estimate, work, problem, minimum), order="damped")
    return replace(found, bias=order_bias(found)) if found.outcome is Outcome.CONVERGED else found


def order_bias(found: Fit) -> Array | None:
    """Where a noise-aware fit of damped order goes from its end (m,), in coordinates, on what the model gives in full
    order there; None where that has no solution.
    """
    assert found.problem is not None
    assert found.estimate is not None
    theta = found.estimate.theta
    experiments = replicate_without_noise(found.problem, theta)
    if experiments is None:
        return None
    again = damped_for(found.kernel, found.coordinates, grids(experiments), theta).fit(theta, STEPS)
    return None if again is None else again.theta - theta
