"""A candidate on its way: fitted to chunks of the recordings first, then refitted to the whole from where that led; and
where the model without it leaves little, refitted along the paths of that."""

from __future__ import annotations

from dataclasses import dataclass, replace

from identification._innovations import lean
from identification._trace_model import FINAL, IDLE, REFIT, RESTED, Model, apart, followed, problem
from identification._trace_screen import Score, promised

KEPT = 0.5
"""Share of the best gain on chunks below which a candidate is given up, or another end of the same one."""
PROSPECT = 30.0
"""Gain, with what the next step promises, below which a refit along the paths of the model is given up: it never comes
to twice as much."""


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


def near(model: Model, s: Score) -> Model | None:
    """A candidate refitted along the paths of the model without it, for as long as it may come to something. New paths
    of a complete model cost hundreds more or less, in which what a weak effect gains is lost.
    """
    found = model.with_effect(s.effect, s.values, steps=RESTED)
    if found is None:
        return None
    work, now, idle = problem(found.effects, found.bench, found.bench.fitted), found.estimate, 0
    for _ in range(REFIT):
        before, now = now.cost, work.descend(now, FINAL, 1)
        left, idle = promised(now.normal)[1], idle + 1 if before - now.cost < IDLE else 0
        if left < IDLE or idle > 1 or model.estimate.cost - now.cost + left < PROSPECT:
            break
    return replace(found, estimate=lean(now))


def refitted(model: Model, b: Begun) -> Model | None:
    """The best refit of a candidate to the whole recordings: on chunks a worse end may look better."""
    refits = [b.near, *(end.carried(model.bench) for end in b.ends)]
    return min((r for r in refits if r is not None), key=lambda r: r.estimate.cost, default=None)
