"""The model that a trace starts from: the base effects fitted to the recordings, in the way that suits them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.data.experiment import Experiment
from identification.data.grid import with_smooth_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import lean
from identification.estimators.fit import fit, order_for_paths
from identification.estimators.fitted import Fit, Outcome, held
from identification.estimators.imposed_motion.fit import fit_imposed_motion
from identification.estimators.imposed_motion.grid import imposed_grids, showing
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.fit import smoothed_starts
from identification.estimators.noise_aware.resolution import RESOLVED_BY_NODES, quickest
from identification.estimators.noise_aware.search import best_on_chunks as best_of_starts
from identification.estimators.noise_aware.search import on_chunks
from identification.tracing import settings
from identification.tracing.models.comparison import is_white
from identification.tracing.models.model import Model
from identification.tracing.models.search import best_model_on_chunks
from identification.tracing.models.trial_data import TrialData, trial_data
from recordings import Array, NegativeAnswer, Progress, silent
from simulator import BASE, Catalogue, Kernel, kernel

AT_BOUND = 0.99
"""Share of a bound from which a base model presses on it."""


def base_model(
    experiments: Sequence[Experiment],
    held_out: Sequence[Experiment],
    given: Mapping[str, float],
    catalogue: Catalogue,
    progress: Progress = silent,
) -> Model:
    """The base model of a trace. Where the motion is imposed the force is predicted, and likewise without a spring,
    where a free run integrates every error of the model. Where not even nodes between samples resolve the bristle it is
    the fit without starting values, in damped order. Raises NegativeAnswer where it cannot be fitted.
    """
    if experiments[0].causality == "motion" or given.get("spring.K") == 0.0:
        return _force_predicting(experiments, held_out, given, catalogue)
    if order_for_paths(experiments, given, catalogue, RESOLVED_BY_NODES) != "full":
        first = fit(experiments, given=given, catalogue=catalogue, progress=progress)
        if first.order != "full":
            return _damped(first, trial_data(experiments, held_out, held(first), catalogue))
    return _noise_aware(trial_data(experiments, held_out, given, catalogue))


def _force_predicting(
    experiments: Sequence[Experiment],
    held_out: Sequence[Experiment],
    given: Mapping[str, float],
    catalogue: Catalogue,
) -> Model:
    """The base model by the force that it predicts from the motion."""
    valve = kernel(BASE, "motion", catalogue)
    u = np.concatenate([s.u for e in experiments for s in e.segments])
    x = np.concatenate([s.motion.x for e in experiments for s in e.segments])
    free = Coordinates.of(valve, given, float(np.std(u)) or 1.0)
    first = fit_imposed_motion(valve, free, experiments)
    if first.minimum is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    data = TrialData(
        tuple(experiments), tuple(held_out), (), (), dict(given), (float(x.min()), float(x.max())),
        float(np.std(u)) or 1.0, catalogue, showing(experiments, catalogue), imposed=True,
    )  # fmt: skip
    model = _weighted(data, valve, first.p)
    model = _weighted(data, valve, model.coordinates.p(model.estimate.theta))  # the errors depend on the model
    return min(model, best_model_on_chunks(model) or model, key=lambda m: m.cost)  # candidates have those starts, too


def _weighted(data: TrialData, valve: Kernel, p: Array) -> Model:
    """The base model fitted from parameters p, with the errors that predicted forces have by them."""
    fitted, others = (
        tuple(imposed_grids(some, valve, p)) for some in (data.experiments, data.held_out_experiments)
    )  # fmt: skip
    data = replace(data, fitted=fitted, held_out=others)
    work = data.estimator(BASE)
    found = work.fit(work.coordinates.theta(p), settings.STEPS)
    if found is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    return Model(BASE, data, lean(found))


def _damped(first: Fit, data: TrialData) -> Model:
    """The base model of a fit in damped order; where that was made in windows, the estimate goes on from its values."""
    if not first.outcome.usable:
        raise NegativeAnswer(first.outcome.value)
    data = data.damped_for(first.values)
    work = data.estimator(BASE)
    theta, known = work.coordinates.theta(first.p), first.estimate
    found = work.fit(theta, settings.STEPS) if known is None else work.along(theta, known.paths, 0)
    if found is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    kept = first if known is None else replace(first, estimate=lean(known))
    return replace(with_stiffness_growth(polished(Model(BASE, data, lean(found)))), fit=kept)


def _noise_aware(data: TrialData) -> Model:
    """The base model by the position, fitted without starting values."""
    valve, free = kernel(BASE, "force", data.catalogue), data.coordinates(BASE)
    found = smoothed_starts(valve, free, with_smooth_force(data.experiments, data.fitted))
    if not found:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    omega, first = quickest(free, found), free.values(found[-1])
    data = replace(
        data.resolving(omega),
        max_mass=settings.BASE_BOUND * first["mass.m"],
        max_stiffness=settings.BASE_BOUND * first["lugre.sigma0"],
    )
    work = NoiseAware(data.kernel(BASE), data.coordinates(BASE), data.fitted, settings.PATH_FREEDOM)
    best = best_of_starts(on_chunks(work), found, most=settings.REPEATS)
    best = None if best is None else work.fit(best.theta, settings.STEPS)
    if best is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    bound = polished(Model(BASE, data, lean(best)))
    return with_stiffness_growth(bound if is_white(bound) else _unbound(bound) or bound)


def _unbound(model: Model) -> Model | None:
    """A base model that presses on its bounds without them; None where it does not, or where that is not enough."""
    values, inf = model.values, float("inf")
    bounds = (values["mass.m"], model.data.max_mass), (values["lugre.sigma0"], model.data.max_stiffness)
    if all(value < AT_BOUND * bound for value, bound in bounds):
        return None
    data = replace(model.data, max_stiffness=inf, max_mass=inf)
    found = best_model_on_chunks(replace(model, data=data))
    if found is None or found.estimate.loss > settings.POOR_LOSS:
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
    if is_white(model) or model.data.damped is not None:  # there every refit looks for new paths
        return min(model, model.refitted(), key=lambda m: m.cost)
    here, other = _refitted_repeatedly(model), best_model_on_chunks(model)
    there = None if other is None else other.refitted_to(model.data)
    if there is None or there.cost >= here.cost or there.estimate.loss >= here.estimate.loss:
        return here
    return _refitted_repeatedly(there)


def _refitted_repeatedly(model: Model) -> Model:
    """A model refitted for as long as that notably helps: plays and hysteresis come to rest slowly."""
    for _ in range(settings.REPEATS):
        before, model = model, model.refitted()
        if model.estimate.settled or model.cost > before.cost - settings.MIN_GAIN / 2:
            break
    return model
