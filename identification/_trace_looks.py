"""Which candidates of a round are looked at: refitted along the paths of a model, and sought on chunks along others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from identification._trace_base import white
from identification._trace_begun import KEPT, PROSPECT, Begun, begun, gain_of, near
from identification._trace_model import Model
from identification._trace_screen import Score
from identification._trace_twin import CLEAR

TRIED = 8
"""Candidates that are sought in a round, the best by score; where all are, those (and what a base model imitates) that
are sought from here too."""
PROMISING = 0.1
"""Share of the best score below which a candidate is not sought; the second best always is."""
SHOWN = 30.0
"""Score below which it is not, either."""
FAR_OFF = 1.4
"""Mean loss from which scores are not to be trusted, and all candidates are sought."""
NEAR, SEEN = 8, 8.0
"""Candidates that are refitted along the paths of the model, the best by score, and their score at least."""

Refits = Mapping[str, Model | None]


def looked(model: Model, scores: Sequence[Score]) -> list[Begun]:
    """The candidates that are worth a look, as far as it goes."""
    close = [] if model.bench.imposed else [s for s in scores[:NEAR] if s.gain > SEEN]
    refits, enough = _refits(model, close)
    shown = _shown(model, scores, refits, enough)
    plain = model.sought() if shown else None
    usual = [s.effect for s in scores[:TRIED]]
    found = [begun(model, plain, s, from_here=s.effect in usual or imitated(model, s)) for s in shown]
    found += [Begun(s, (), s.gain) for s in close if s not in shown]
    return [replace(b, near=refits.get(b.score.effect)) for b in found]


def imitated(model: Model, s: Score) -> bool:
    """Whether a model imitates an effect so well that its score says little and its own paths do not lead to it."""
    return bool(model.imitations(s.effect))


def _refits(model: Model, close: Sequence[Score]) -> tuple[Refits, float]:
    """Candidates refitted along the paths of the model, and the gain of one that explains all that it leaves, where
    that is much; 0 without one. Others are then of interest only that explain about as much: what it should not have
    explained shows in the next round. Those that are imitated well imitate each other, and do not count.
    """
    refits, enough = dict[str, Model | None](), 0.0
    for s in close:
        refits[s.effect] = refit = near(model, s, enough)
        if refit is not None and gain_of(model, refit) > max(CLEAR, enough) and not imitated(model, s) and white(refit):
            enough = gain_of(model, refit)
    return refits, enough


def _shown(model: Model, scores: Sequence[Score], refits: Refits, enough: float) -> list[Score]:
    """The candidates that are sought on chunks. What can be refitted along the paths of a model that leaves nothing,
    or of one that another explains, is sought only where that gains something, or about as much.
    """
    if enough:
        return [s for s in scores if gain_of(model, refits.get(s.effect)) > KEPT * enough]
    promising = [s for i, s in enumerate(scores) if _promises(s, i, scores[0])]
    if white(model) and not model.bench.imposed:
        return [s for s in promising if imitated(model, s) or gain_of(model, refits.get(s.effect)) > PROSPECT]
    if model.estimate.loss > FAR_OFF:
        return list(scores)
    return [s for s in scores if s in promising or imitated(model, s)]


def _promises(s: Score, place: int, best: Score) -> bool:
    """Whether a candidate promises as much as to be sought on chunks. place : by score."""
    return s.gain > SHOWN and (place < 2 or (place < TRIED and s.gain > PROMISING * best.gain))
