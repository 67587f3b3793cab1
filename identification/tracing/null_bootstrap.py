"""Whether as much would be gained where nothing is missing: a parametric bootstrap of the acceptance of an effect.

The held-out test knows what noise can do; it does not know descents that end beside the best model, after which any
effect that leads on from there gains hundreds on all recordings. So where a gain is not beyond such doubt, the model
without the effect is run on the smoothed force, noise is added to both channels, and on these twins, which lack
nothing, model and effect are sought like on the recordings (Efron and Tibshirani, An Introduction to the Bootstrap,
1993, ch. 16). What the effect gains there is what it gains by chance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.data.experiment import Experiment
from identification.data.grid import with_smooth_force
from identification.estimators.noise_aware.resolution import MOST_BETWEEN, SWING, swing
from identification.tracing.base import first_model, settled, trial_data, white
from identification.tracing.free_runs import as_fit
from identification.tracing.model import Model, followed
from identification.tracing.refine import Begun, begun, near, refitted
from identification.tracing.screen import Score
from identification.uncertainty.bootstrap import replicate
from recordings import NegativeAnswer
from simulator import BASE

CLEAR, CLEAR_UNRESOLVED = 300.0, 2000.0
"""Gain beyond doubt: in the studies of docs/trace.md effects gained up to 17 where nothing was missing. Where the nodes
do not resolve a swing on the bristles, models end beside their best by up to 1000."""
TWINS = 6
"""Twins at most; fewer where they agree early."""
BY_CHANCE = 0.05
"""Level of the test, for all candidates of the catalogue together. It stands beside the held-out one."""
LEAST = 5.0
"""Gain by chance of a twin at least: about what candidates gain that were refitted where nothing is missing."""


def chance(model: Model, refit: Model, effect: str, doubtful: bool) -> float | None:
    """The probability that some candidate gains on a twin of a model as much as a refit with an effect gains on the
    recordings, from as few twins as decide it; None where the gain is beyond doubt. doubtful : whatever it is.
    """
    if model.data.imposed:
        return None
    if not doubtful and model.estimate.cost - refit.estimate.cost > _clear(model):
        return None
    gain, values = surplus(model, refit, effect), {n: refit.values[n] for n in refit.values if n not in model.values}
    rng, by_chance, many = np.random.default_rng(0), list[float](), len(model.data.candidates)
    for left in reversed(range(TWINS)):
        found = _gain_of_a_twin(model, effect, values, rng)
        by_chance += [] if found is None else [max(LEAST, found)]
        at_best = many * probability(gain, by_chance + [LEAST] * left)
        if at_best > BY_CHANCE or many * probability(gain, by_chance) < BY_CHANCE:
            break
    return min(1.0, many * probability(gain, by_chance))


def probability(gain: float, by_chance: list[float]) -> float:
    """Probability that what is gained by chance exceeds `gain`, where it is exponentially distributed and so much was
    gained on some twins: what is known of the mean is in it (a Pareto distribution, with the prior 1/mean).
    """
    return float((1.0 + max(gain, 0.0) / sum(by_chance)) ** -len(by_chance)) if by_chance else 1.0


def surplus(model: Model, refit: Model, effect: str) -> float:
    """What a refit gains by its effect: over the model without it, and over what the refit becomes without it."""
    without = refit.without(effect)
    costs = [m.estimate.cost for m in (model, without) if m is not None]
    return min(costs) - refit.estimate.cost


def _clear(model: Model) -> float:
    """Gain beyond doubt for recordings of such sampling."""
    spacing = max(s.dt for e in model.data.recorded[0] for s in e.segments)
    return CLEAR if swing(model.values) * spacing < SWING * MOST_BETWEEN else CLEAR_UNRESOLVED


def _gain_of_a_twin(model: Model, effect: str, values: dict[str, float], rng: np.random.Generator) -> float | None:
    """What an effect gains on one twin of a model; None where the model is not found again at all."""
    data = model.data
    pairs = zip(data.recorded, (data.fitted, data.held), strict=True)
    fitted, held = (replicate(as_fit(model, with_smooth_force(*pair)), rng) for pair in pairs)
    found = _sought(model, fitted, held)
    if found is None:
        return None
    score = Score(effect, 0.0, values)
    looked = Begun(score, (), 0.0) if white(found) else begun(found, found.sought(), score, from_here=True)
    refit = refitted(found, replace(looked, near=near(found, score)))
    return 0.0 if refit is None else surplus(found, refit, effect)


def _sought(model: Model, fitted: list[Experiment], held: list[Experiment]) -> Model | None:
    """The same effects fitted to other recordings: a base model as at first, others from usual values of the base."""
    given = model.data.given
    if model.effects == BASE:
        try:
            return first_model(fitted, held, given)
        except NegativeAnswer:
            return None
    seen = trial_data(fitted, held, given).resolving(swing(model.values))
    data = replace(model.data, fitted=seen.fitted, held=seen.held, recorded=seen.recorded)
    ends = followed(replace(model, data=data).looks(from_here=False))
    carried = ends[0].carried(data) if ends else None
    return None if carried is None else settled(carried)
