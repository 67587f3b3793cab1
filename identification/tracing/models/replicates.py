"""Recordings that a model could have given: it is run in full order on the smoothed force, and noise of the estimated
size is added to position and force. They lack nothing, so what the model leaves of them a complete model leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from identification.data.experiment import Experiment
from identification.data.grid import with_smooth_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from identification.estimators.fitted import FREE_STEP, Fit, fit_of, fit_of_free_runs
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.order import swing
from identification.estimators.output_error.descent import Minimum
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.replicates import following
from identification.tracing.models.trial_data import TrialData, trial_data
from identification.uncertainty.bootstrap import replicate
from simulator import Causality, kernel


class Fitted(Protocol):
    """A model with its estimate on some data, as `Model` is one."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Ids of its effects."""

    @property
    def data(self) -> TrialData:
        """What it was fitted to."""

    @property
    def estimate(self) -> Estimate:
        """The estimate on the fitted grids."""

    @property
    def coordinates(self) -> Coordinates:
        """What is free."""

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by full name, SI units."""


def as_fit(model: Fitted, experiments: Sequence[Experiment]) -> Fit:
    """The model as a fit to experiments, whose force is smoothed unless it is what the model predicts."""
    damped = model.data.damped
    causality: Causality = "motion" if model.data.imposed else "force"
    valve = kernel(model.effects, causality, model.data.catalogue, damped=damped is not None)
    problem, estimate = Problem(valve, model.coordinates, experiments), model.estimate
    if model.data.imposed:
        unknowns = problem.start(estimate.theta)
        minimum = Minimum(unknowns, estimate.normal, ResidualForm(0.0), 0, estimate.settled)
        return fit_of_free_runs(valve, model.coordinates, problem, minimum)
    form = ResidualForm(FREE_STEP if damped is None else damped.h_max)
    minimum = Minimum(problem.start(estimate.theta), estimate.normal, form, 0, estimate.settled)
    work = model.data.estimator(model.effects)
    assert isinstance(work, NoiseAware)
    return replace(fit_of(estimate, work, problem, minimum), order="full" if damped is None else "damped")


def replicate_of(model: Fitted, rng: np.random.Generator) -> TrialData:
    """The data of a model as it could have given them, fitted and held out."""
    data = model.data
    pairs = ((data.experiments, data.fitted), (data.held_out_experiments, data.held_out))
    fitted, held_out = (replicate(_in_full_order(as_fit(model, with_smooth_force(*pair))), rng) for pair in pairs)
    new = trial_data(fitted, held_out, data.given, data.catalogue)
    new = new.resolving(swing(model.values)) if data.damped is None else new.damped_for(model.values)
    return replace(
        data, fitted=new.fitted, held_out=new.held_out, experiments=new.experiments,
        held_out_experiments=new.held_out_experiments, damped=new.damped,
    )  # fmt: skip


def _in_full_order(found: Fit) -> Fit:
    """A fit as a plant whose bristles swing, whatever order it was fitted in."""
    if found.order == "full" or found.problem is None or found.minimum is None:
        return found
    full = kernel(found.kernel.effects, "force", found.kernel.catalogue)
    problem = Problem(full, found.coordinates, found.problem.experiments)
    return replace(found, problem=problem, minimum=replace(found.minimum, setting=following(found.values)))
