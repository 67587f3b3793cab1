"""A motion-driven fit without starting values: output error of the force that a rig's motion takes.

There is no timing to be missed, so one descent is enough. The residual counts every sample with the noise of the force
channel alone and the memory that each segment starts with is fitted too, as in any output-error fit. `ImposedMotion`
(estimator.py), which tracing tries its candidates with, goes on from here: it counts what the position's noise does to
the predicted force as well, leaves out the samples before memory is forgotten, and takes no part of the memory as free.
"""

from __future__ import annotations

from collections.abc import Sequence

from identification.data.close_motion import closely_imposed
from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates
from identification.estimators.fitted import Fit, Outcome, fit_of_free_runs
from identification.estimators.least_squares import minimise
from identification.estimators.output_error.descent import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.starting_values import starting_values
from recordings import Progress, silent
from simulator import Kernel

STARTS, ITERATIONS, TOLERANCE = 3, 60, 1e-6
"""Starting values that are followed, and iterations and relative fall of the cost at which each descent ends."""


def fit_imposed_motion(
    valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment], progress: Progress = silent
) -> Fit:
    """Fit from several starting values, keep the best. The residual is the predicted force minus the measured one."""
    problem, best = Problem(valve, coordinates, [closely_imposed(e) for e in experiments]), None
    setting = ResidualForm(0.0)
    progress("starting values", 0, 0)
    starts = starting_values(experiments, valve, coordinates)[:STARTS]
    for done, start in enumerate(starts):
        progress("fit", done, len(starts))
        unknowns = problem.start(start.theta)
        first = problem.evaluate(unknowns, setting)
        if first is None:
            continue
        level = first.cost / problem.samples
        hold = problem.held(unknowns, setting, level)
        bounds = coordinates.bounds.padded(len(unknowns))
        end = minimise(hold, unknowns, bounds=bounds, iterations=ITERATIONS, tolerance=TOLERANCE)
        if end is not None and (best is None or end.normal.cost < best.normal.cost):
            best = Minimum(end.theta, end.normal, setting, end.evaluations, end.settled)
    if best is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    return fit_of_free_runs(valve, coordinates, problem, best)
