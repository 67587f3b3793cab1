"""The model that a trace starts from: the base effects fitted to the recordings, in the way that suits them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import lean
from identification.estimators.fit import fit
from identification.estimators.fitted import Fit, Outcome, held
from identification.estimators.imposed_motion.fit import fit_imposed_motion
from identification.estimators.imposed_motion.grid import imposed_grids, missed_square, showing
from identification.estimators.order import Order, swing
from identification.tracing import settings
from identification.tracing.models.comparison import is_white
from identification.tracing.models.model import Model
from identification.tracing.models.search import best_model_on_chunks
from identification.tracing.models.trial_data import TrialData, trial_data
from recordings import Array, NegativeAnswer, Progress, silent
from simulator import BASE, Catalogue, Kernel, kernel


def base_model(
    experiments: Sequence[Experiment],
    held_out: Sequence[Experiment],
    given: Mapping[str, float],
    catalogue: Catalogue,
    progress: Progress = silent,
    *,
    order: Order | Literal["auto"] = "auto",
) -> Model:
    """The base model of a trace: the fit of `fit` to the recordings, and from there on as candidates are fitted. Where
    the motion is imposed the force is predicted, and likewise without a spring, where a free run integrates every error
    of the model. order : of `fit`. Raises NegativeAnswer where it cannot be fitted.
    """
    if experiments[0].causality == "motion" or given.get("spring.K") == 0.0:
        return _force_predicting(experiments, held_out, given, catalogue)
    first = fit(experiments, given=given, order=order, catalogue=catalogue, progress=progress)
    if not first.outcome.usable:
        raise NegativeAnswer(first.outcome.value)
    return _going_on(first, trial_data(experiments, held_out, held(first), catalogue))


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
    model = _weighted(data, valve, _p(model))  # the errors depend on the model
    model = _weighted(data, valve, _p(model), missing=True)  # and what it misses does
    model = _weighted(data, valve, _p(model), missing=True)
    return min(model, best_model_on_chunks(model) or model, key=lambda m: m.cost)  # candidates have those starts, too


def _weighted(data: TrialData, valve: Kernel, p: Array, *, missing: bool = False) -> Model:
    """The base model fitted from parameters p, with the errors that predicted forces have by them. missing : whether
    these count as one part of what is left, beside what the model misses with p throughout.
    """
    fitted, held_out = (imposed_grids(some, valve, p) for some in (data.experiments, data.held_out_experiments))
    missed = missed_square(fitted, valve, p) if missing else 0.0
    fitted, held_out = ([grid.beside(missed) for grid in grids] for grids in (fitted, held_out))
    data = replace(data, fitted=tuple(fitted), held_out=tuple(held_out))
    work = data.estimator(BASE)
    found = work.fit(work.coordinates.theta(p), settings.STEPS)
    if found is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    return Model(BASE, data, lean(found))


def _p(model: Model) -> Array:
    """The parameter vector of a model."""
    return model.coordinates.p(model.estimate.theta)


def _going_on(first: Fit, data: TrialData) -> Model:
    """The base model of a fit: its estimate on its paths, where it has some with the same nodes, and on new ones else,
    as after a fit by free runs or in windows.
    """
    data = data.resolving(swing(first.values)) if first.order == "full" else data.damped_for(first.values)
    work, known = data.estimator(BASE), first.estimate
    p = first.p if known is None else first.coordinates.p(known.theta)  # candidates are not less their bias, either
    theta, nodes = work.coordinates.theta(p), [len(grid.t) for grid in work.grids]
    if known is not None and [len(path) for path in known.paths] == nodes:
        found = work.along(theta, known.paths, 0)
    else:
        found = work.fit(theta, settings.STEPS)
    if found is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    kept = first if known is None else replace(first, estimate=lean(known))
    return replace(with_stiffness_growth(polished(Model(BASE, data, lean(found)))), fit=kept)


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
    if model.data.damped is not None or is_white(model):  # in damped order every refit looks for new paths
        return min(model, model.refitted(), key=lambda m: m.cost)
    here, other = _refitted_repeatedly(model), best_model_on_chunks(model)
    there = None if other is None else other.refitted_to(model.data, here.cost)
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
