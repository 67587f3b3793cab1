"""Whether as much would be gained where nothing is missing: a parametric bootstrap of the acceptance of an effect.

The held-out test knows what noise can do. It does not know descents that end beside the best model, after which any
effect that leads on from there gains hundreds on all recordings. So where a gain is not beyond such doubt, the model
without the effect is run on the smoothed force and noise is added to both channels. On these null replicates, which
lack nothing, the model is fitted as on the recordings and all effects are tried beside it, and what the best of them
gains there is gained by chance (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, ch. 16). So the level
holds for all candidates together. It holds for all rounds together as well, because a round is only reached when all
tests before it rejected (a fixed sequence of tests: Maurer, Hothorn and Lehmacher 1995).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from identification.budget import Budget
from identification.tracing import settings
from identification.tracing.models.base import polished
from identification.tracing.models.comparison import is_white
from identification.tracing.models.model import REPLICATE_SEED, Model
from identification.tracing.models.replicates import replicate_of
from identification.tracing.models.search import best_model_on_chunks, continued, first_fits
from identification.tracing.models.trial_data import TrialData
from identification.tracing.refine import (
    CandidateFit,
    fit_on_chunks,
    refit_on_base_paths,
    refitted,
)
from identification.tracing.screen import Score, screen
from recordings import Progress, silent


def null_probability(
    model: Model, refit: Model, effect: str, doubtful: bool, budget: Budget, progress: Progress = silent
) -> float | None:
    """The probability that some candidate gains on a null replicate of a model as much as a refit with an effect gains
    on the recordings, from as few replicates as decide it; None where the gain is beyond doubt, 1 where there was no
    time for any: what may be chance is not named. doubtful : it is not beyond doubt, however large.
    """
    if model.data.imposed:
        return None
    if not doubtful and model.cost - refit.cost > model.clear_gain:
        return None
    gain, values = net_gain(model, refit, effect), {n: refit.values[n] for n in refit.values if n not in model.values}
    rng, gains = np.random.default_rng(REPLICATE_SEED), list[float]()
    replicates = settings.NULL_REPLICATES
    for done in range(1, replicates + 1):
        if not budget.allows(f"null replicates of {effect}"):
            break
        progress(f"null replicates of {effect}, gain {gain:.0f}", done - 1, replicates)
        hopeless = _hopeless(gain, gains, replicates - done)
        found = _gain_of_replicate(model, Score(effect, 0.0, values), rng, budget, hopeless)
        if not budget.allows(f"null replicates of {effect}"):  # some candidates may not have been tried on it
            break
        gains += [] if found is None else [max(settings.CHANCE_GAIN, found)]
        if (gains and hopeless(gains[-1])) or tail_probability(gain, gains) < settings.LEVEL:
            break
    progress("null replicates", replicates, replicates)
    return tail_probability(gain, gains)


def _hopeless(gain: float, gains: Sequence[float], left: int) -> Callable[[float], bool]:
    """Whether a gain is not significant any more, whatever is gained on as many replicates as are left, once so much
    was gained on one more than those known.
    """
    best = [settings.CHANCE_GAIN] * left
    return lambda most: tail_probability(gain, [*gains, max(settings.CHANCE_GAIN, most), *best]) > settings.LEVEL


def tail_probability(gain: float, gains: Sequence[float]) -> float:
    """Probability that what is gained by chance exceeds `gain`, where so much was gained on some null replicates, as if
    that were exponentially distributed: the largest of several chance gains is less spread than that. What is known of
    the mean is in it (a Pareto distribution, with the prior 1/mean).
    """
    return float((1.0 + max(gain, 0.0) / sum(gains)) ** -len(gains)) if gains else 1.0


def net_gain(model: Model, refit: Model, effect: str) -> float:
    """What a refit gains by its effect: over the model without it, and over what the refit becomes without it."""
    without = refit.without(effect, model.cost)
    return min(m.cost for m in (model, without) if m is not None) - refit.cost


def _gain_of_replicate(
    model: Model, score: Score, rng: np.random.Generator, budget: Budget, hopeless: Callable[[float], bool]
) -> float | None:
    """The most that an effect gains on one null replicate of a model: the scored one, from where it led to on the
    recordings, or any other; None where the model is not found again at all. No further one is tried once so much is
    gained that it is `hopeless`.
    """
    found = _found_again(model, replicate_of(model, rng))
    if found is None:
        return None
    return _largest_gain(found, score, budget, hopeless)


def _largest_gain(found: Model, score: Score, budget: Budget, hopeless: Callable[[float], bool]) -> float:
    """The most that an effect gains beside a model: the scored one first, from there, then those whose scores may lead
    to more than the largest gain so far; on chunks, too, where something is left of the model.
    """
    most, white = 0.0, is_white(found)
    on_chunks = None if white else best_model_on_chunks(found)
    for s in _one_after_the_other(found, score):
        if hopeless(most) or budget.over or (s is not score and settings.PROMISE_FACTOR * s.gain < most):
            break
        best_gain = most / settings.GAIN_SHARE  # beside which less is hopeless
        small = best_gain * found.data.chunk_share
        fit = CandidateFit(s, (), 0.0) if white else fit_on_chunks(found, on_chunks, s, True, small)
        if fit.gain < most * found.data.chunk_share:  # no refit to the whole gains more
            fit = replace(fit, chunk_fits=())
        near = refit_on_base_paths(found, s, settings.GAIN_SHARE * best_gain)
        refit = refitted(found, replace(fit, base_path_refit=near), most)
        if refit is not None and found.cost - refit.cost > most:  # no net gain is more
            most = max(most, net_gain(found, refit, s.effect))
    return most


def _one_after_the_other(found: Model, score: Score) -> Iterator[Score]:
    """The scored effect, and then, where that has not decided, all by their scores beside the model."""
    yield score
    yield from screen(found)


def _found_again(model: Model, data: TrialData) -> Model | None:
    """The same effects fitted to other recordings, on chunks from usual values of the base and then to the whole."""
    ends = continued(first_fits(replace(model, data=data), from_here=data.damped is not None))
    refit = ends[0].refitted_to(data) if ends else None
    return None if refit is None else polished(refit)
