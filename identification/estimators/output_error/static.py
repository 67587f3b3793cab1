"""The fit where set-points are recorded a second apart: where the valve rests, and what friction holds there.

A slip is over before the next sample, so what only a slip tells is held at a valve whose slips are quick. Spring,
preload and friction are fitted in runs that are set back to the data, and their intervals hold what that biases.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates
from identification.estimators.fitted import Fit, Outcome, fit_of_windows
from identification.estimators.least_squares import minimise
from identification.estimators.order import at_rest
from identification.estimators.output_error.force_position_loop import force_position_loop
from identification.estimators.output_error.homotopy import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.replicates import in_windows, replicates
from identification.estimators.output_error.window_search import WindowSearch, told
from recordings import Progress, silent
from simulator import Kernel, kernel

TUNING = 3.0
"""Tuning of the Cauchy loss of the fit, in sigmas."""
FINER = 4
"""Part of the search's sub-step that the fit takes: the step's own error would bias it by more than the noise does."""
ITERATIONS = 40
LITTLE = 1e-3
"""Share of the cost that another step may promise when the fit stops: friction has kinks, and no step keeps it."""
TRIALS = 3
"""Replicates that tell bias and the loss that a right model leaves."""


def fit_static(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], progress: Progress = silent
) -> Fit:  # fmt: skip
    """Fit spring, preload and friction, without starting values, to experiments with a smooth force."""
    model = kernel(valve.effects, "force", valve.catalogue, damped=True)
    loop = force_position_loop(smooth, coordinates.held("spring.K"))
    if loop is None:
        return Fit(Outcome.TOO_SHORT, model, coordinates)
    coordinates = coordinates.holding(at_rest(loop.K))
    search = WindowSearch(model, coordinates, smooth, loop)
    ends = search.ends(progress)
    if not ends:
        return Fit(Outcome.DIVERGED, model, coordinates)
    progress("fit to whole recordings", 0, 0)
    whole = Problem(model, coordinates, told(smooth, loop), loop)
    form = ResidualForm(search.h / FINER, search.window, TUNING)
    unknowns = whole.start(ends[0].theta[: coordinates.n_free])
    bounds = coordinates.bounds.padded(len(unknowns))
    evaluate = functools.partial(in_windows, whole, form)
    end = minimise(evaluate, unknowns, bounds=bounds, iterations=ITERATIONS, tolerance=3e-5)
    if end is None:
        return Fit(Outcome.DIVERGED, model, coordinates)
    settled = end.settled or end.left < LITTLE * end.normal.cost
    level = end.normal.cost / max(whole.samples, 1)
    minimum = Minimum(end.theta, end.normal, form, search.evaluations + end.evaluations, settled, level)
    found = fit_of_windows(whole, minimum, replicates(whole, end.theta, form, TRIALS))
    return replace(found, order="static", rms=float(np.nan_to_num(found.rms, nan=1.0)))
