"""A traced model as the rest of the toolkit knows it: a fit with free runs, uncertainties and its `model.json`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identification.data.close_motion import closely_imposed
from identification.data.experiment import Experiment
from identification.data.grid import with_smooth_force
from identification.estimators.fitted import FREE_STEP, Fit, fit_of_free_runs
from identification.estimators.imposed_motion.grid import ImposedGrid
from identification.estimators.noise_aware.best_paths import BestPathsNoiseAware
from identification.estimators.noise_aware.search import WholeFit
from identification.estimators.output_error.descent import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.systematic_error import without_bias
from identification.identified import Identification
from identification.result import error_of, free_runs, valve_model
from identification.sparse_regression.crosscheck import crosscheck
from identification.tracing.models.model import Model
from identification.tracing.models.replicates import as_fit
from identification.tracing.models.trial_data import TrialData
from identification.uncertainty.covariance import uncertainty_of
from recordings import Recording
from simulator import kernel


def free_run_experiments(data: TrialData) -> tuple[list[Experiment], list[Experiment]]:
    """The fitted and the held-out experiments as free runs need them: with a smoothed force, or an imposed motion."""
    if data.imposed:
        return [closely_imposed(e) for e in data.experiments], [closely_imposed(e) for e in data.held_out_experiments]
    fitted = with_smooth_force(data.experiments, data.fitted)
    return list(fitted), list(with_smooth_force(data.held_out_experiments, data.held_out))


def identification_of(
    model: Model, recordings: Sequence[Recording], experiments: Sequence[Experiment], held_out: Sequence[Experiment]
) -> Identification:
    """The model with its free runs on the fitted and the held-out experiments, as after a fit: the fit itself, where it
    is one.
    """
    fit = _known(model, experiments) if model.fit is None else _with_derivatives(model.fit)
    runs, others = free_runs(fit, experiments, fitted=False), free_runs(fit, held_out, fitted=False)
    known = uncertainty_of(fit)
    check = crosscheck(fit, model.data.experiments, known)
    quality: dict[str, object] = {"crosscheck": check.sentence}
    stored = valve_model(fit, known, recordings, experiments, {"fit": runs, "holdout": others}, quality)
    return Identification(fit, known, stored, runs, others, check, ())


def _with_derivatives(found: Fit) -> Fit:
    """A fit with the derivatives of its estimate, which one that is kept does without."""
    if found.estimate is None or found.noise_aware is None:
        return found
    estimate = found.noise_aware.along(found.estimate.theta, found.estimate.paths, 0)
    return found if estimate is None else replace(found, estimate=replace(estimate, settled=found.estimate.settled))


def _known(model: Model, experiments: Sequence[Experiment]) -> Fit:
    """The model as a fit with what its uncertainty needs: derivatives, which kept models do without, and as a fit it
    is less the bias of its order.
    """
    found = as_fit(model.with_path_steps(0), experiments)
    if not isinstance(found.noise_aware, BestPathsNoiseAware) or found.estimate is None:
        return found
    return without_bias(found, WholeFit(found.noise_aware, found.estimate))


def holdout_rmse(model: Model, experiments: Sequence[Experiment], held_out: Sequence[Experiment]) -> float:
    """Free-run error of a model on held-out experiments [m], [N] where the force is predicted; NaN when it diverges."""
    error = error_of(free_runs(as_fit(model, experiments), held_out, fitted=False)) or {}
    return error.get("rmse_N" if model.data.imposed else "rmse_m", float("nan"))


def free_run_errors(
    base: Model, final: Model, before: Identification, after: Identification, report: Sequence[Experiment]
) -> dict[str, Any]:
    """The free-run errors of two models with their identifications, and the noise floors, as `trace.json` has them.
    report : experiments that neither fitted nor chose a model.
    """
    data, errors = base.data, dict[str, Any]()
    driven = [closely_imposed(e) for e in report] if data.imposed else with_smooth_force(report)
    for side, model, found in (("before", base, before), ("after", final, after)):
        errors[side] = {
            "fit": _error(model, error_of(found.trajectories), data.experiments),
            "holdout": _error(model, error_of(found.holdout), data.held_out_experiments),
            "report": _error(model, error_of(free_runs(found.fit, driven, fitted=False)) if driven else None, report),
        }
    errors["noise_floor_m"] = float(np.sqrt(np.mean([e.noise_position**2 for e in data.experiments])))
    if data.imposed:
        floors = [grid.floor for grid in data.fitted if isinstance(grid, ImposedGrid)]
        errors["noise_floor_N"] = float(np.sqrt(np.mean(np.square(floors))))
    return errors


def _error(model: Model, error: dict[str, float] | None, experiments: Sequence[Experiment]) -> dict[str, float] | None:
    """A free-run error; where it is the force's, the position's beside it, with the plain names of the contract."""
    if not model.data.imposed or error is None:
        return error
    position = _position_error(model, experiments)
    return {"rmse_N": error["rmse_N"], "nrmse_N": error.get("nrmse", 0.0)} | position


def _position_error(model: Model, experiments: Sequence[Experiment]) -> dict[str, float]:
    """Free-run error of the position where the force drives a plant whose force is what the model predicts; nothing
    where a rig imposes the motion, or where the free run diverges.
    """
    if not experiments or experiments[0].causality == "motion":
        return {}
    valve = kernel(model.effects, "force", model.data.catalogue)
    problem = Problem(valve, model.coordinates, experiments)
    minimum = Minimum(problem.start(model.estimate.theta), model.estimate.normal, ResidualForm(FREE_STEP), 0, True)
    fit = fit_of_free_runs(valve, model.coordinates, problem, minimum)
    return (error_of(free_runs(fit, experiments, fitted=False)) or {}) if fit.problem is not None else {}
