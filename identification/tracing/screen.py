"""Which effects could explain the residual: a score test of every candidate at its neutral strength.

At the fitted model, the derivatives by the strength of a candidate say how far the cost would fall to first order if it
were added and everything refitted (Rao's score test). Shapes that a strength of zero does not show (the place of a
tight spot, the frequency of a disturbance) are those of the effect's first guess.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from identification.tracing import settings
from identification.tracing.models.guesses import SMALL, EffectGuesses, known_guesses, shapes, sizes, strengths
from identification.tracing.models.model import Model
from identification.tracing.models.promise import newton_step
from recordings import Progress, silent, tracked

VISIBLE = 1e-12
"""Curvature by a coordinate, relative to the largest, below which it is nothing but rounding."""


@dataclass(frozen=True)
class Score:
    """An effect at its best shape. gain : fall of the cost to first order; values : parameters by full name with the
    strength where that fall is expected; guesses : other values to start from, those of a base that was bent included;
    others : values at other shapes that promise not much less.
    """

    effect: str
    gain: float
    values: Mapping[str, float]
    guesses: EffectGuesses = ()
    others: tuple[Mapping[str, float], ...] = ()


def screen(model: Model, progress: Progress = silent) -> list[Score]:
    """The scores of all candidates that a model does not have, best first. They are tried on chunks, and their gains
    scaled to the whole recordings.
    """
    candidates = [e for e in model.data.candidates if e not in model.effects]
    found, small = known_guesses(model), model.on_chunks()
    share = model.data.samples / small.data.samples
    scores = [best_score(small, effect, found[effect]) for effect in tracked(candidates, "score test", progress)]
    return sorted((replace(s, gain=s.gain * share) for s in scores if s is not None), key=lambda s: -s.gain)


def best_score(model: Model, effect: str, found: EffectGuesses) -> Score | None:
    """The score of an effect at its best shape; None when the recordings do not show it at all.

    A strength that can only grow from zero is also tried at some sizes: a play operator at rest on noise shows
    nothing to first order.
    """
    ways, gain = [{}, *sizes(model.data, effect, found)], attrgetter("gain")

    def at(shape: Mapping[str, float]) -> Score | None:
        scores = (_score(model, effect, shape, size) for size in ways)
        return max((score for score in scores if score is not None), key=gain, default=None)

    known = [score for score in map(at, shapes(model.data, effect, found)) if score is not None]
    if not known:
        return None
    best, *others = sorted(known, key=gain, reverse=True)[: settings.AT_LEAST]
    near = tuple(s.values for s in others if s.gain > settings.GAIN_SHARE * best.gain)
    return replace(best, guesses=found, others=near)


def _score(model: Model, effect: str, shape: Mapping[str, float], size: Mapping[str, float]) -> Score | None:
    """The score of an effect of some shape about its neutral strengths, or about some size of them."""
    trial = model.with_effect(effect, {**shape, **size}, steps=settings.PATH_STEPS if size else 0)
    if trial is None:
        return None
    own, known = trial.data.catalogue[effect].parameter_names(), strengths(trial.data, effect)
    normal, names = trial.estimate.normal, trial.coordinates.free_names
    curvature = np.diag(normal.matrix)
    visible = curvature > VISIBLE * curvature.max()
    added = np.array([name in known for name in names]) & visible
    old = np.array([name not in own for name in names]) & visible
    if not added.any():
        return None
    move, gain = newton_step(normal, added | old)
    gain += model.cost_at_rest - trial.cost if size else -newton_step(normal, old)[1]
    values = {name: value for name, value in trial.values.items() if name in own}
    for i in np.flatnonzero(added):
        parameter = known[names[i]]
        step = float(np.clip(move[i], -settings.MAX_STRENGTH, settings.MAX_STRENGTH))
        if parameter.lower == parameter.neutral and step <= 0 and not size:
            gain, step = 0.0, SMALL
        values[names[i]] = float(np.clip(values[names[i]] + step * parameter.scale, parameter.lower, parameter.upper))
    return Score(effect, max(gain, 0.0), values)
