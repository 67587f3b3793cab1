"""Of several effects together: whether another stands for one of them as well.

While one effect is still missing, another that bends more may explain more than the right one. So once nothing is left
to add, each effect is exchanged for those that were judged beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from identification.tracing.model import Model
from simulator import CATALOGUE


class Judged(Protocol):
    """A candidate that was refitted: its effect and the values of that effect's parameters."""

    @property
    def effect(self) -> str: ...
    @property
    def values(self) -> Mapping[str, float]: ...


def exchanged(
    model: Model, added: tuple[str, ...], beside: Mapping[str, Sequence[Judged]], alike: float
) -> tuple[Model, tuple[str, ...], tuple[str, ...]]:
    """The model and its effects with every effect exchanged for the simplest that costs at most `alike` more than the
    best, and what cannot be told from the first of them. beside : by effect, the candidates that were judged with it.
    """
    classes = []
    for effect in added:
        others = {c.effect: c.values for c in beside.get(effect, ()) if c.effect not in added}
        models = {effect: model}
        for other, values in others.items():
            found = model.exchanged(effect, other, values)
            if found is not None:
                models[other] = found
        least = min(m.estimate.cost for m in models.values())
        near = [e for e, m in models.items() if m.estimate.cost < least + alike]
        chosen = min(near, key=size)
        model, added = models[chosen], tuple(chosen if e == effect else e for e in added)
        classes.append(tuple(e for e in near if e != chosen))
    return model, added, classes[0]


def size(effect: str) -> int:
    """Number of free parameters of an effect."""
    return sum(not p.known for p in CATALOGUE[effect].parameters)
