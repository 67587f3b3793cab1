"""A traced model as the rest of the toolkit knows it: a fit with free runs, uncertainties and its `model.json`."""

from __future__ import annotations

from collections.abc import Sequence

from identification._crosscheck import crosscheck
from identification._experiment import Experiment
from identification._fit import Fit, fit_of
from identification._homotopy import Path
from identification._problem import Problem, Setting
from identification._result import Identification, error_of, free_runs, valve_model
from identification._trace_model import Model
from identification._uncertain_force import FREE_STEP
from identification._uncertainty import uncertainty
from recordings import Recording
from simulator import kernel


def as_fit(model: Model, experiments: Sequence[Experiment]) -> Fit:
    """The model as a fit to experiments whose force is smoothed."""
    problem = Problem(kernel(model.effects), model.coordinates, experiments)
    estimate = model.estimate
    path = Path(problem.start(estimate.theta), estimate.normal, Setting(FREE_STEP), 0, estimate.settled)
    return fit_of(estimate, problem, path)


def identification_of(
    model: Model, recordings: Sequence[Recording], experiments: Sequence[Experiment], held: Sequence[Experiment]
) -> Identification:
    """The model with its free runs on the fitted and the held-out experiments, as after a fit."""
    fit = as_fit(model.relaxed(0), experiments)  # with the derivatives, which models that are kept do without
    runs, others = free_runs(fit, experiments, fitted=False), free_runs(fit, held, fitted=False)
    known = uncertainty(fit)
    check = crosscheck(fit, experiments, known.std)
    quality: dict[str, object] = {"crosscheck": None if check is None else check.sentence}
    stored = valve_model(fit, known, recordings, experiments, {"fit": runs, "holdout": others}, quality)
    return Identification(fit, known, stored, runs, others, check, ())


def holdout_rmse(model: Model, experiments: Sequence[Experiment], held: Sequence[Experiment]) -> float:
    """Free-run error of a model on held-out experiments [m]; NaN when it diverges."""
    error = error_of(free_runs(as_fit(model, experiments), held, fitted=False))
    return (error or {}).get("rmse_m", float("nan"))
