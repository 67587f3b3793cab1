"""Fits to chunks of the recordings, from several starting values: where a fit to all of them is to start.

A model that lacks an effect bends its parameters to make up for it, and from there the way back can be barred. So the
same effects are also started from usual values, and a candidate from where a model without it may have bent.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.estimators.estimate import Estimate, lean
from identification.estimators.path_estimator import PathEstimator
from identification.tracing import settings
from identification.tracing.models.guesses import EffectGuesses, strengths
from identification.tracing.models.model import Model
from identification.tracing.models.promise import may_reach
from identification.tracing.models.usual_values import usual_values
from recordings import Array

SHARES = (1.0, 0.4)
"""Shares of a guess at which fits start. Beside a play much wider than the plant's the valve slips elsewhere, and fits
then end where it vanishes.
"""


def best_model_on_chunks(model: Model) -> Model | None:
    """The best fit of a model's effects to chunks of its grids; None where all diverge."""
    return next(iter(continued(first_fits(model))), None)


def first_fits(
    model: Model,
    *effect: str,
    values: Mapping[str, float] | None = None,
    guesses: EffectGuesses = (),
    from_here: bool = True,
) -> list[Model]:
    """First fits of a model, or of it and one more effect at some values, to chunks of its grids, best first.

    They start from here, unless that is not wanted; with the mass, the damping and the friction curve set back to usual
    ones; and from guesses that say what a model without the effect has bent, each from the better of its `SHARES`.
    Empty where all diverge.
    """
    effects = model.data.in_order(*model.effects, *effect)
    data, _ = model.data.on_chunks()
    work = data.estimator(effects, coarse=True)
    known = {k: v for e in effect for k, v in model.data.defaults(e).items()} | model.values | dict(values or {})
    theta = work.coordinates.theta(work.kernel.vector(known))
    usual = usual_values(work.coordinates, theta)[:1]
    own = _started(work, [theta, *usual] if from_here else usual)
    off = {n: p.neutral or 0.0 for e in effect for n, p in strengths(data, e).items()} | model.values
    bending = [guess for guess in guesses if not model.values.keys().isdisjoint(guess)]
    tried = [[work.kernel.vector(known | _between(off, guess, share)) for share in SHARES] for guess in bending]
    ends = [_started(work, [work.coordinates.theta(p) for p in some])[:1] for some in tried]
    guessed = sorted(itertools.chain.from_iterable(ends), key=lambda fit: fit.cost)
    others = settings.AT_LEAST if data.damped is None else 1  # along new paths most starts lead to one end
    best = sorted([*own, *guessed], key=lambda fit: fit.cost)[:others]
    if guessed and all(fit is not guessed[0] for fit in best):  # plays and hysteresis come to rest slowly
        best.append(guessed[0])
    return [Model(effects, data, fit) for fit in best]


def continued(fits: Sequence[Model], least: float = np.inf, *, clearly: bool = False) -> list[Model]:
    """First fits continued while they may come below a cost, best first. clearly : that is so far below what chance
    makes of new paths that first fits of damped order, which have taken no step, tell as well whether they may.
    """
    ends = list[Model]()
    for fit in fits:
        if (clearly or fit.data.damped is None) and not may_reach(fit.estimate, least):
            ends.append(fit)
            continue
        work = fit.data.estimator(fit.effects, coarse=True, worth=settings.CHANCE_GAIN)
        taken = _first_steps() if fit.data.damped is None else 0
        end = work.further(fit.estimate, settings.STEPS - taken, lambda now: not may_reach(now, least))
        ends.append(replace(fit, estimate=lean(end)))
    return sorted(ends, key=lambda end: end.cost)


def differ(effect: str, one: Model, other: Model) -> bool:
    """Whether two fits ended at different places, by the parameters of an effect."""
    names = one.data.catalogue[effect].parameter_names()
    a, b = (np.array([model.values[name] for name in names]) for model in (one, other))
    return bool((np.abs(a - b) > settings.SMALL_SHARE * np.maximum(np.abs(a), np.abs(b))).any())


def _between(off: Mapping[str, float], guess: Mapping[str, float], share: float) -> dict[str, float]:
    """Values on the way from a model without an effect to a guess; shapes are those of the guess."""
    return {name: off.get(name, x) + share * (x - off.get(name, x)) for name, x in guess.items()}


def _started(work: PathEstimator, starts: Sequence[Array]) -> list[Estimate]:
    """First fits from some starting values, best first."""
    fits = [work.first(start, _first_steps()) for start in starts]
    return sorted((fit for fit in fits if fit is not None), key=lambda fit: fit.cost)


def _first_steps() -> int:
    """Steps after which starts are compared: bad ones show by then."""
    return settings.STEPS // 3
