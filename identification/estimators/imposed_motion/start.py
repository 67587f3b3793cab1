"""The motion-driven fit: the rig imposes the motion, the force is predicted from it; no timing, so no homotopy."""

from __future__ import annotations

from collections.abc import Sequence

from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import descend
from identification.estimators.output_error.homotopy import Path
from identification.estimators.output_error.problem import Problem, Setting
from identification.estimators.starting_values import starts
from simulator import Kernel


def fit_imposed(
    kernel: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]
) -> tuple[Path | None, Problem]:
    """Fit from every start, keep the best. The residual is the measured force minus the predicted one."""
    problem, best = Problem(kernel, coordinates, experiments), None
    setting = Setting(0.0)
    for start in starts(experiments, kernel.effects, coordinates)[:3]:
        unknowns = problem.start(start.theta)
        first = problem.evaluate(unknowns, setting)
        if first is None:
            continue
        level = first.cost / problem.samples
        end = descend(problem.held(unknowns, setting, level), unknowns, iterations=60, tolerance=1e-6)
        if end is not None and (best is None or end.normal.cost < best.normal.cost):
            best = Path(end.theta, end.normal, setting, end.evaluations, end.settled)
    return best, problem
