"""The model that a trace starts from: the base effects fitted to the recordings, in the way that suits them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.data.experiment import Experiment, Segment, imposed
from identification.data.grid import grids, with_smooth_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import lean
from identification.estimators.fitted import Outcome
from identification.estimators.imposed_motion.fit import fit_imposed_motion
from identification.estimators.imposed_motion.grid import imposed_grids, showing
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.fit import smoothed_starts
from identification.estimators.noise_aware.resolution import quickest
from identification.estimators.noise_aware.search import best_on_chunks, on_chunks
from identification.tracing.judge import Whiteness, whiteness
from identification.tracing.model import FINAL, REFIT, Model, TrialData, coordinates, problem
from recordings import NegativeAnswer
from simulator import BASE, CATALOGUE, kernel

WAYS = 4
"""Ways that a base model is sought on chunks: one that lacks an effect fits badly at the end of all of them."""
STIFFER = 2.0
"""Bristles are at most so many times as stiff as those of the model without the effect."""
HEAVIER, RIGID = 5.0, 4.0
"""A base model is at most so many times as heavy, and its bristles as stiff, as the inverse equation says at first,
unless that is all it lacks: what lacks an effect may have a mass of tons or a rigid stem swallow it, and then nothing
looks like what is missing."""
AT_BOUND, LACKING = 0.99, 1.4
"""Share of that at which a model presses on it, and mean loss on chunks from which freedom is not all it lacks."""
BETTER = 10.0
"""Fall of the cost by which a refit notably helps."""
REFITS = 3
"""Refits of a model at most, for as long as they do."""
HELD_SHARE = 0.25
"""Share of each recording that is held out when no recording is."""


def first_model(experiments: Sequence[Experiment], others: Sequence[Experiment], given: Mapping[str, float]) -> Model:
    """The base model from which effects are sought. Where the motion is imposed the force is predicted, and likewise
    without a spring, where a free run integrates every error of the model.
    """
    if experiments[0].causality == "motion" or given.get("spring.K") == 0.0:
        return imposed_model(experiments, others, given)
    return base_model(experiments, trial_data(experiments, others, given))


def imposed_model(experiments: Sequence[Experiment], others: Sequence[Experiment], given: Mapping[str, float]) -> Model:
    """The base model by the force that it predicts from the motion."""
    valve, driven = kernel(BASE, "motion"), [imposed(e) for e in experiments]
    u = np.concatenate([s.u for e in driven for s in e.segments])
    x = np.concatenate([s.motion.x for e in driven for s in e.segments])
    free = Coordinates.of(valve, given, float(np.std(u)) or 1.0)
    first = fit_imposed_motion(valve, free, driven)
    if first.minimum is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    p = first.p
    fitted, held = (tuple(imposed_grids(some, valve, p)) for some in (experiments, others))
    data = TrialData(
        fitted, held, dict(given), (float(x.min()), float(x.max())), float(np.std(u)) or 1.0, imposed=True,
        candidates=showing(experiments, CATALOGUE), recorded=(tuple(experiments), tuple(others)),
    )  # fmt: skip
    work = problem(BASE, data, fitted)
    found = work.fit(work.coordinates.theta(p), REFIT)
    if found is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    return Model(BASE, data, lean(found))


def base_model(experiments: Sequence[Experiment], data: TrialData) -> Model:
    """The base model, fitted without start values."""
    valve, free = kernel(BASE), coordinates(BASE, data)
    found = smoothed_starts(valve, free, with_smooth_force(experiments, data.fitted))
    if not found:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    omega, guess = quickest(free, found), free.values(found[-1])
    data = replace(data.resolving(omega), heaviest=HEAVIER * guess["mass.m"], stiffest=RIGID * guess["lugre.sigma0"])
    work = NoiseAware(data.kernel(BASE), coordinates(BASE, data), data.fitted, FINAL)
    best = best_on_chunks(on_chunks(work), found, most=WAYS)
    best = None if best is None else work.fit(best.theta, REFIT)
    if best is None:
        raise NegativeAnswer(Outcome.DIVERGED.value)
    bound = settled(Model(BASE, data, lean(best)))
    return stiffened(bound if white(bound) else freed(bound) or bound)


def freed(model: Model) -> Model | None:
    """A base model that presses on its bounds without them; None where it does not, or still leaves something."""
    values, inf = model.values, float("inf")
    bounds = (values["mass.m"], model.data.heaviest), (values["lugre.sigma0"], model.data.stiffest)
    if all(value < AT_BOUND * most for value, most in bounds):
        return None
    data = replace(model.data, heaviest=inf, stiffest=inf)
    found = replace(model, data=data).sought()
    if found is None or found.estimate.loss > LACKING:
        return None
    carried = found.carried(data)
    free = None if carried is None else settled(carried)
    return free if free is not None and white(free) else None


def stiffened(model: Model) -> Model:
    """The model with bristles that may become stiffer once more: what lacks an effect may have softened them."""
    if model.data.imposed:
        return model
    return replace(model, data=replace(model.data, stiffest=STIFFER * model.values["lugre.sigma0"]))


def trial_data(experiments: Sequence[Experiment], held: Sequence[Experiment], given: Mapping[str, float]) -> TrialData:
    """The data of some experiments."""
    fitted, other = grids(experiments), grids(held)
    x = np.concatenate([s.motion[:, 0] for s in fitted])
    force = np.concatenate([s.force.u for s in fitted])
    return TrialData(
        tuple(fitted), tuple(other), dict(given), (float(x.min()), float(x.max())), float(np.std(force)),
        recorded=(tuple(experiments), tuple(held)),
    )  # fmt: skip


def settled(model: Model) -> Model:
    """A model fitted on from where it is, and along new paths from the best that a search on chunks finds; the better
    of both. One that leaves nothing is only fitted on: candidates are, too, and must not gain by that.

    What lacks an effect has many ends that differ by hundreds in cost, by its paths alone. Candidates are sought from
    new paths, so the model that they are held against must have been, too: or any of them explains that difference.
    """
    if white(model):
        return min(model, model.refitted(), key=lambda m: m.estimate.cost)
    here, other = rested(model), model.sought()
    there = None if other is None else other.carried(model.data)
    if there is None or there.estimate.cost >= here.estimate.cost or there.estimate.loss >= here.estimate.loss:
        return here
    return rested(there)


def rested(model: Model) -> Model:
    """A model refitted for as long as that notably helps: plays and hysteresis come to rest slowly."""
    for _ in range(REFITS):
        before, model = model, model.refitted()
        if model.estimate.settled or model.estimate.cost > before.estimate.cost - BETTER:
            break
    return model


def split(experiments: Sequence[Experiment]) -> tuple[list[Experiment], list[Experiment]]:
    """The first part of every recording to fit, the last to judge, by the positions that they hold."""

    def parts(e: Experiment) -> tuple[Experiment, Experiment]:
        first, last = list[Segment](), list[Segment]()
        wanted = (1 - HELD_SHARE) * sum(int(s.seen.sum()) for s in e.segments)
        for s in e.segments:
            edge = int(np.searchsorted(np.cumsum(s.seen), wanted, side="right"))
            wanted -= int(s.seen.sum())
            if edge > 10:
                first.append(s.part(0, edge))
            if len(s.t) - edge > 10:
                last.append(s.part(edge, len(s.t)))
        return e.with_segments(tuple(first)), e.with_segments(tuple(last))

    pairs = [parts(e) for e in experiments]
    return [a for a, _ in pairs], [b for _, b in pairs]


def white(model: Model) -> bool:
    """Whether nothing is left on fitted and held-out grids."""
    return fit_left(model).white and held_left(model).white


def fit_left(model: Model) -> Whiteness:
    """Whether anything is left on the fitted grids."""
    return whiteness(model.estimate)


def held_left(model: Model) -> Whiteness:
    """Whether anything is left on the held-out grids."""
    return whiteness(model.held) if model.held is not None else Whiteness(False, 0.0, float("inf"), 1.0)
