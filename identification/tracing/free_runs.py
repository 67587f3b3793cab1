"""A traced model as the rest of the toolkit knows it: a fit with free runs, uncertainties and its `model.json`."""

from __future__ import annotations

from collections.abc import Sequence

from identification.data.experiment import Experiment
from identification.estimators.fitted import FREE_STEP, Fit, fit_of, fit_of_free_runs
from identification.estimators.output_error.homotopy import Minimum
from identification.estimators.output_error.problem import Problem, Setting
from identification.result import Identification, error_of, free_runs, valve_model
from identification.sparse_regression import crosscheck
from identification.tracing.model import Model
from identification.uncertainty.covariance import uncertainty_of
from recordings import Recording
from simulator import kernel


def as_fit(model: Model, experiments: Sequence[Experiment]) -> Fit:
    """The model as a fit to experiments, whose force is smoothed unless it is what the model predicts."""
    valve = kernel(model.effects, "motion" if model.data.imposed else "force")
    problem, estimate = Problem(valve, model.coordinates, experiments), model.estimate
    if model.data.imposed:
        unknowns = problem.start(estimate.theta)
        minimum = Minimum(unknowns, estimate.normal, Setting(0.0), 0, estimate.settled)
        return fit_of_free_runs(valve, model.coordinates, problem, minimum)
    minimum = Minimum(problem.start(estimate.theta), estimate.normal, Setting(FREE_STEP), 0, estimate.settled)
    return fit_of(estimate, problem, minimum)


def identification_of(
    model: Model, recordings: Sequence[Recording], experiments: Sequence[Experiment], held: Sequence[Experiment]
) -> Identification:
    """The model with its free runs on the fitted and the held-out experiments, as after a fit."""
    fit = as_fit(model.relaxed(0), experiments)  # with the derivatives, which models that are kept do without
    runs, others = free_runs(fit, experiments, fitted=False), free_runs(fit, held, fitted=False)
    known = uncertainty_of(fit)
    check = crosscheck(fit, experiments, known.std)
    quality: dict[str, object] = {"crosscheck": None if check is None else check.sentence}
    stored = valve_model(fit, known, recordings, experiments, {"fit": runs, "holdout": others}, quality)
    return Identification(fit, known, stored, runs, others, check, ())


def position_error(model: Model, experiments: Sequence[Experiment]) -> dict[str, float]:
    """Free-run error of the position where the force drives a plant whose force is what the model predicts; nothing
    where a rig imposes the motion, or where the free run diverges.
    """
    if not experiments or experiments[0].causality == "motion":
        return {}
    valve = kernel(model.effects)
    problem = Problem(valve, model.coordinates, experiments)
    minimum = Minimum(problem.start(model.estimate.theta), model.estimate.normal, Setting(FREE_STEP), 0, True)
    fit = fit_of_free_runs(valve, model.coordinates, problem, minimum)
    return (error_of(free_runs(fit, experiments, fitted=False)) or {}) if fit.problem is not None else {}


def holdout_rmse(model: Model, experiments: Sequence[Experiment], held: Sequence[Experiment]) -> float:
    """Free-run error of a model on held-out experiments [m], [N] where the force is predicted; NaN when it diverges."""
    error = error_of(free_runs(as_fit(model, experiments), held, fitted=False)) or {}
    return error.get("rmse_N" if model.data.imposed else "rmse_m", float("nan"))
