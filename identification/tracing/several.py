"""Of several effects together: which are needed, whether another stands for one of them as well, and which comes first.

While one effect is still missing, another that bends more may explain more than the right one, and is accepted first.
Once the right one is beside it, the model loses little without it or nothing: it is dropped or comes last. And once
nothing is left to add, each effect is swapped for those that were judged beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from identification.tracing import settings
from identification.tracing.models.comparison import compare
from identification.tracing.models.model import Model
from simulator import CATALOGUE, Catalogue


class Rival(Protocol):
    """A candidate that was judged beside an effect: its id, and the values of its parameters from which to start."""

    @property
    def effect(self) -> str:
        """The id of the effect."""

    @property
    def values(self) -> Mapping[str, float]:
        """Parameter values by full name, SI units."""


def pruned(model: Model, added: Sequence[str]) -> tuple[Model, tuple[str, ...]]:
    """The model without what it does not need (an effect that was added before a better one, or one whose gain came of
    fitting the others better), and its effects: those first without which it loses most.
    """
    if not added:
        return model, ()
    others = {effect: model.without(effect) for effect in added}
    costs = {effect: np.inf if other is None else other.cost for effect, other in others.items()}
    *needed, last = sorted(added, key=lambda effect: -costs[effect])
    rest = others[last]
    if rest is not None and rest.cost < model.cost + settings.MIN_GAIN:
        return pruned(rest, needed)
    return model, (*needed, last)


def swapped(
    model: Model,
    added: tuple[str, ...],
    rivals: Mapping[str, Sequence[Rival]],
    catalogue: Catalogue = CATALOGUE,
) -> tuple[Model, tuple[str, ...], dict[str, tuple[str, ...]]]:
    """The model and its effects with every effect swapped for the simplest that costs at most `MIN_GAIN` more than the
    best, of those that do not explain what is held out less, and the effects that cannot be told from each of them.
    rivals : by effect.
    """
    classes, margin = dict[str, tuple[str, ...]](), settings.MIN_GAIN
    for effect in added:
        others = {r.effect: r.values for r in rivals.get(effect, ()) if r.effect not in added}
        models = {effect: model}
        for other, values in others.items():
            most = min(m.cost for m in models.values()) + margin
            found = model.swapped(effect, other, values, most)
            if found is not None and found.cost < most and not _explains_less(found, model):
                models[other] = found
        least = min(m.cost for m in models.values())
        alike = [e for e, m in models.items() if m.cost < least + margin]
        chosen = min(alike, key=lambda e: n_free_parameters(e, catalogue))
        model, added = models[chosen], tuple(chosen if e == effect else e for e in added)
        classes[chosen] = tuple(e for e in alike if e != chosen)
    return model, added, classes


def _explains_less(model: Model, other: Model) -> bool:
    """Whether a model explains the held-out recordings significantly less than another: it only fits better."""
    if model.held_out is None or other.held_out is None:
        return other.held_out is not None
    lost = compare(model.held_out, other.held_out, other.data.held_out)
    return lost.gain > settings.MIN_GAIN and lost.p_value < settings.LEVEL


def n_free_parameters(effect: str, catalogue: Catalogue) -> int:
    """Number of free parameters of an effect."""
    return sum(not p.known for p in catalogue[effect].parameters)
