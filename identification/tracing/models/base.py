"""The model that a trace starts from: the base effects fitted to the recordings, in the way that suits them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.data.experiment import Experiment, imposed
from identification.data.grid import with_smooth_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import lean
from identification.estimators.fit import fit
from identification.estimators.fitted import Outcome
from identification.estimators.imposed_motion.fit import fit_imposed_motion
from identification.estimators.imposed_motion.grid import imposed_grids, showing
from identification.estimators.output_error.starting_values import starting_values
from identification.tracing import settings
from identification.tracing.models.comparison import is_white
from identification.tracing.models.model import Model
from identification.tracing.models.search import best_model_on_chunks
from identification.tracing.models.trial_data import TrialData, trial_data
from recordings import NegativeAnswer
from simulator import BASE, Catalogue, kernel


def base_model(
    experiments: Sequence[Experiment],
    held_out: Sequence[Experiment],
    given: Mapping[str, float],
    catalogue: Catalogue,
) -> Model:
    """The base model of a trace. Where the motion is imposed the force is predicted, and likewise without a spring,
    where a free run integrates every error of the model. Raises NegativeAnswer where it cannot be fitted.
    """
    if experiments[0].causality == "motion" or given.get("spring.K") == 0.0:
        return _force_predicting(experiments, held_out, given, catalogue)
    return _noise_aware(trial_data(experiments, held_out, given, catalogue))


def _force_predicting(
    experiments: Sequence[Experiment],
    held_out: Sequence[Experiment],
    given: Mapping[str, float],
    catalogue: Catalogue,
) -> Model:
    """The base model by the force that it predicts from the motion."""
    valve, driven = kernel(BASE, "motion", catalogue), [imposed(e) for e in experiments]
    u = np.concatenate([s.u for e in driven for s in e.segments])
    x = np.concatenate([s.motion.x for e in driven for s in e.segments])
    free = Coordinates.of(valve, given, float(np.std(u)) or 1.0)
    first = fit_imposed_motion(valve, free, driven)
    if first.minimum is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    fitted, others = (tuple(imposed_grids(some, valve, first.p)) for some in (experiments, held_out))
    data = TrialData(
        tuple(experiments), tuple(held_out), fitted, others, dict(given), (float(x.min()), float(x.max())),
        float(np.std(u)) or 1.0, catalogue, showing(experiments, catalogue), imposed=True,
    )  # fmt: skip
    work = data.estimator(BASE)
    found = work.fit(work.coordinates.theta(first.p), settings.REFIT_STEPS)
    if found is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    return Model(BASE, data, lean(found))


def _noise_aware(data: TrialData) -> Model:
    """The base model by the position: what `fit` finds, refitted with the freedom of the paths that all models have.

    What lacks an effect may have a mass of tons or a rigid stem swallow it. Beyond what is usual it is only free where
    nothing but noise is left then.
    """
    found = fit(data.experiments, given=data.given, catalogue=data.catalogue, estimator="noise-aware")
    if found.estimate is None or found.noise_aware is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    work = found.noise_aware
    data = data.like(work.grids, work.freedom.h_max if work.kernel.damped else 0.0)
    if found.outcome is not Outcome.CONVERGED:
        data = _bounded(data, found.values)
    theta = data.coordinates(BASE).bounds.nearest(found.estimate.theta)
    best = data.estimator(BASE).fit(theta, settings.REFIT_STEPS)
    if best is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    bound = polished(Model(BASE, data, lean(best)))
    return with_stiffness_growth(bound if is_white(bound) else _unbound(bound) or bound)


def _bounded(data: TrialData, values: Mapping[str, float]) -> TrialData:
    """The data with bounds on mass and stiffness of the bristles; values : of a fit, by full name, which are within the
    bound on the stiffness where the sampling does not resolve it: a regression cannot see it there, either.
    """
    valve = kernel(BASE, "force", data.catalogue)
    starts = starting_values(with_smooth_force(data.experiments, data.fitted), valve, data.coordinates(BASE))
    if not starts:
        return data
    rough = data.coordinates(BASE).values(starts[0].theta)
    stiffest = settings.STIFFNESS_BOUND * rough["lugre.sigma0"]
    return replace(
        data,
        max_mass=settings.MASS_BOUND * rough["mass.m"],
        max_stiffness=max(stiffest, values["lugre.sigma0"]) if data.sub_step else stiffest,
    )


def _unbound(model: Model) -> Model | None:
    """A base model that presses on its bounds without them; None where it does not, or where that is not enough."""
    values, inf = model.values, float("inf")
    bounds = (values["mass.m"], model.data.max_mass), (values["lugre.sigma0"], model.data.max_stiffness)
    if all(value < settings.AT_BOUND * bound for value, bound in bounds):
        return None
    data = replace(model.data, max_stiffness=inf, max_mass=inf)
    found = best_model_on_chunks(replace(model, data=data))
    if found is None or found.estimate.loss > settings.UNBOUNDED_LOSS:
        return None
    refit = found.refitted_to(data)
    free = None if refit is None else polished(refit)
    return free if free is not None and is_white(free) else None


def with_stiffness_growth(model: Model) -> Model:
    """The model with bristles that may become stiffer once more: what lacks an effect may have softened them."""
    if model.data.imposed:
        return model
    bound = settings.STIFFNESS_GROWTH * model.values["lugre.sigma0"]
    return replace(model, data=replace(model.data, max_stiffness=bound))


def polished(model: Model) -> Model:
    """The better of two refits of a model: from where it is, and on new paths from the best fit to chunks. One whose
    residual is noise is only refitted from where it is: candidates are, too, and must not gain by that.

    What lacks an effect has many ends that differ by hundreds in cost, by its paths alone. Candidates are fitted on new
    paths, so the model that they are compared with must have been, too: or any of them explains that difference.
    """
    if is_white(model):
        return min(model, model.refitted(), key=lambda m: m.cost)
    here, other = _refitted_repeatedly(model), best_model_on_chunks(model)
    there = None if other is None else other.refitted_to(model.data)
    if there is None or there.cost >= here.cost or there.estimate.loss >= here.estimate.loss:
        return here
    return _refitted_repeatedly(there)


def _refitted_repeatedly(model: Model) -> Model:
    """A model refitted for as long as that notably helps: plays and hysteresis come to rest slowly."""
    for _ in range(settings.REPEATED_REFITS):
        before, model = model, model.refitted()
        if model.estimate.settled or model.cost > before.cost - settings.NOTABLE_GAIN:
            break
    return model
