"""A candidate on its way: fitted to chunks of the recordings first, then refitted to the whole from where that led; and
where the model without it leaves little, refitted along the paths of that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from identification.estimators.estimate import Estimate, lean
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.tracing.model import FINAL, IDLE, REFIT, RESTED, Model, apart, followed
from identification.tracing.screen import Score, promised, strengths

KEPT = 0.5
"""Share of the best gain on chunks below which a candidate is given up, or another end of the same one."""
PROSPECT = 30.0
"""Gain, with what the next step promises, below which a refit along the paths of the model is given up: it never comes
to twice as much."""
AHEAD, SLOW = 4.0, 0.02
"""How many times as much as the next step promises a refit may still gain, where a shape is not right yet, and share of
what another gains that two steps must not stay below, where one does explain all."""


@dataclass(frozen=True)
class Begun:
    """A candidate fitted to chunks. ends : the best and others not far behind it, none without a solution; gain : fall
    of the cost by the best of them; near : refitted to the whole along the paths of the model without it."""

    score: Score
    ends: tuple[Model, ...]
    gain: float
    near: Model | None = None


def begun(model: Model, plain: Model | None, s: Score, from_here: bool) -> Begun:
    """A candidate with its ends on chunks, held against the model without it there."""
    ends = followed(model.looks(s.effect, values=s.values, from_here=from_here))
    if plain is None or not ends:
        return Begun(s, (), s.gain)
    gain = [plain.estimate.cost - end.estimate.cost for end in ends]
    others = [
        end for end, g in zip(ends[1:], gain[1:], strict=True) if g > KEPT * gain[0] and apart(s.effect, end, ends[0])
    ]
    return Begun(s, (ends[0], *others), gain[0])


def near(model: Model, s: Score, beside: float = 0.0) -> Model | None:
    """A candidate refitted along the paths of the model without it, for as long as it may come to something, beside
    another that gains so much. New paths of a complete model cost hundreds more or less, in which what a weak effect
    gains is lost.

    Where it can it starts from nothing: at the strength that the score promises, paths may already lead elsewhere. If
    that does not come to what the score says, it starts there, too.
    """
    sizes = strengths(s.effect)
    neutral = {n: p.neutral for n, p in sizes.items() if p.neutral is not None and p.lower < p.neutral}
    first = _along(model, s.effect, {**s.values, **neutral}, beside)
    if not neutral or gain_of(model, first) > s.gain:
        return first
    second = _along(model, s.effect, s.values, beside)
    return first if gain_of(model, first) > gain_of(model, second) else second


def _along(model: Model, effect: str, values: Mapping[str, float], beside: float) -> Model | None:
    """A refit along the paths of the model from some values; None where they have no solution."""
    found = model.with_effect(effect, values, steps=RESTED)
    if found is None:
        return None

    def vain(now: Estimate) -> bool:
        left, gain = promised(now.normal)[1], model.estimate.cost - now.cost
        return left < IDLE or gain + left < PROSPECT or gain + AHEAD * left < KEPT * beside

    work = NoiseAware(found.kernel, found.coordinates, found.data.fitted, FINAL, max(IDLE, SLOW * beside))
    return replace(found, estimate=lean(work.descend(found.estimate, REFIT, vain)))


def refitted(model: Model, b: Begun) -> Model | None:
    """The best refit of a candidate to the whole recordings: on chunks a worse end may look better. The one along the
    paths of the model is enough where it gains what chunks promise for the whole.
    """
    enough = gain_of(model, b.near) * model.data.in_chunks > b.gain
    refits = [b.near] if enough else [b.near, *(end.carried(model.data) for end in b.ends)]
    return min((r for r in refits if r is not None), key=lambda r: r.estimate.cost, default=None)


def gain_of(model: Model, refit: Model | None) -> float:
    """What a refit gains over the model without an effect; 0 where there is none."""
    return 0.0 if refit is None else model.estimate.cost - refit.estimate.cost
