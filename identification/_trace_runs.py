"""A traced model as the rest of the toolkit knows it: a fit with free runs, uncertainties and its `model.json`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification._coordinates import Coordinates
from identification._crosscheck import crosscheck
from identification._experiment import Experiment
from identification._fit import Fit, Outcome
from identification._homotopy import Path
from identification._problem import Problem, Setting
from identification._result import Identification, error_of, free_runs, valve_model
from identification._trace_model import Model
from identification._uncertainty import PRIOR_LOG_STD, Uncertainty, judged
from recordings import Recording
from simulator import kernel

Array = NDArray[np.float64]

FREE_STEP = 2.5e-4
"""Sub-step of the free runs [s]."""


def as_fit(model: Model, experiments: Sequence[Experiment]) -> Fit:
    """The model as a fit to experiments whose force is smoothed."""
    driven, c = kernel(model.effects), model.coordinates
    plain = Coordinates(driven.parameters, c.base, c.free, c.logs, c.scale, c.lower, c.upper)
    problem = Problem(driven, plain, experiments)
    estimate = model.estimate
    path = Path(problem.start(estimate.theta), estimate.normal, Setting(FREE_STEP), 0, estimate.settled)
    return Fit(Outcome.CONVERGED, driven, plain, problem, path, float(np.sqrt(estimate.loss)))


def identification_of(
    model: Model, recordings: Sequence[Recording], experiments: Sequence[Experiment], held: Sequence[Experiment]
) -> Identification:
    """The model with its free runs on the fitted and the held-out experiments, as after a fit."""
    fit = as_fit(model, experiments)
    runs, others = free_runs(fit, experiments, fitted=False), free_runs(fit, held, fitted=False)
    known = uncertainty_of(model, fit)
    check = crosscheck(fit, experiments, known.std)
    quality: dict[str, object] = {"crosscheck": None if check is None else check.sentence}
    stored = valve_model(fit, known, recordings, experiments, {"fit": runs, "holdout": others}, quality)
    return Identification(fit, known, stored, runs, others, check, ())


def holdout_rmse(model: Model, experiments: Sequence[Experiment], held: Sequence[Experiment]) -> float:
    """Free-run error of a model on held-out experiments [m]; NaN when it diverges."""
    error = error_of(free_runs(as_fit(model, experiments), held, fitted=False))
    return (error or {}).get("rmse_m", float("nan"))


def uncertainty_of(model: Model, fit: Fit) -> Uncertainty:
    """Standard deviations from the linearised paths, force noise included."""
    matrix = model.estimate.normal.matrix
    covariance = np.linalg.inv(matrix + np.eye(len(matrix)) / PRIOR_LOG_STD**2) * max(model.estimate.loss, 1.0)
    spread = np.sqrt(np.diag(covariance))
    names = tuple(n for n, free in zip(fit.kernel.parameters, fit.coordinates.free, strict=True) if free)
    correlation = covariance / np.outer(spread, spread)
    std = dict(zip(names, (spread * fit.coordinates.slope(fit.p)).tolist(), strict=True))
    status, note = judged(fit, names, std, correlation)
    scale = np.sqrt(np.diag(matrix)).clip(1e-150)
    eigen = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
    condition = float(np.sqrt(eigen[-1] / max(eigen[0], 1e-30)))
    return Uncertainty(names, std, correlation, condition, status, note, 1.0)
