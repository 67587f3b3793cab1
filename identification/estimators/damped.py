"""The fit in damped order: by runs that are set back to the data, and with the force estimated where that converges.

Runs in windows find their way from nothing but the loop of force over position, at any sampling. Where the force is
noisy the noise-aware estimate goes on from there: it tells friction many times better. Where samples do not show the
course of a slip either of them may fail, and then the other is asked; where they show nothing of it but its end, runs
in windows are first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from identification.data.experiment import Experiment
from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from identification.estimators.fitted import Fit, Outcome, fit_of, free_run_start
from identification.estimators.noise_aware.damped import damped_for
from identification.estimators.noise_aware.damped_search import best_on_chunks, from_both_sides, on_whole_recordings
from identification.estimators.noise_aware.fit import fit_noise_aware
from identification.estimators.noise_aware.resolution import resolved_by_nodes
from identification.estimators.noise_aware.search import UNEXPLAINED
from identification.estimators.order import Order
from identification.estimators.output_error.damped import Search, fit_in_windows, search_for
from identification.estimators.output_error.homotopy import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.systematic_error import without_bias
from recordings import Array, Progress, silent
from simulator import Kernel, kernel


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
    starts = search.ends(progress)

    def in_windows() -> Fit:
        return fit_in_windows(search, starts, order, progress)

    def noise_aware() -> Fit:
        found = _noise_aware(valve, coordinates, smooth, segment_grids, search, starts, progress, told)
        return found or in_windows()

    if not (segment_grids and starts and order == "damped"):
        return in_windows()
    if search.shows_slips:
        return noise_aware()
    first, second = (in_windows, noise_aware) if search.jumps else (noise_aware, in_windows)
    found = first()
    if found.outcome is Outcome.CONVERGED:
        return found
    other = second()
    return other if other.outcome is Outcome.CONVERGED else found


def _noise_aware(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], segment_grids: Sequence[Grid],
    search: Search, starts: Sequence[Array], progress: Progress, told: bool,
) -> Fit | None:  # fmt: skip
    """The noise-aware fit from the ends of a search (m,), the likeliest first, in full order where they lead to a swing
    that nodes resolve; None where the model diverges from all.
    """
    problem = Problem(kernel(valve.effects, "force", valve.catalogue, damped=True), coordinates, smooth)

    def is_resolved(end: Estimate) -> bool:
        if told or end.loss > UNEXPLAINED:  # what explains nothing says nothing of the swing
            return False
        return resolved_by_nodes(coordinates.values(end.theta), problem.spacing)

    work = damped_for(valve, coordinates, segment_grids, starts[0])
    best = best_on_chunks(work, _narrowed(search, starts), is_resolved, progress)
    if best is None:
        return None
    if is_resolved(best):
        return fit_noise_aware(valve, coordinates, smooth, segment_grids, [best.theta], progress)
    progress("fit to whole recordings", 0, 0)
    whole = on_whole_recordings(work.resolving(best.theta), best)
    if whole is None:
        return None
    if whole.explains and not (whole.is_root or search.shows_slips):  # costs differ little between slips that are jumps
        whole = from_both_sides(whole)
    work, estimate = whole.work, whole.end
    form = ResidualForm(work.freedom.h_max)
    minimum = Minimum(free_run_start(problem, estimate), estimate.normal, form, 0, estimate.settled)
    found = replace(fit_of(estimate, work, problem, minimum), order="damped")
    if not whole.explains:
        return found
    found = replace(found, outcome=Outcome.CONVERGED)
    return without_bias(found, whole)


def _narrowed(search: Search, starts: Sequence[Array]) -> Iterator[Array]:
    """The ends of a search (m,) in its narrow loss, each when it is asked for: the first is mostly enough."""
    for start in starts:
        end = search.narrowed(start)
        if end is not None:
            yield end
