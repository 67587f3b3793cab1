"""Which candidates of a round are looked at: refitted along the paths of a model, and sought on chunks along others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from identification.tracing.base import fit_left, white
from identification.tracing.judge import COMPLETE
from identification.tracing.model import Model
from identification.tracing.null_bootstrap import CLEAR
from identification.tracing.refine import KEPT, PROSPECT, Begun, begun, gain_of, near
from identification.tracing.screen import Score

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
    close = [] if model.data.imposed else [s for s in scores[:NEAR] if s.gain > SEEN]
    refits, all_of_it = _refits(model, close)
    shown = _shown(model, scores, refits, all_of_it)
    plain = model.sought() if shown else None
    usual = [s.effect for s in scores[:TRIED]]
    found = [begun(model, plain, s, from_here=s.effect in usual or imitated(model, s)) for s in shown]
    found += [Begun(s, (), s.gain) for s in close if s not in shown]
    return [replace(b, near=refits.get(b.score.effect)) for b in found]


def imitated(model: Model, s: Score) -> bool:
    """Whether a model imitates an effect so well that its score says little and its own paths do not lead to it."""
    return bool(model.imitations(s.effect))


def _refits(model: Model, close: Sequence[Score]) -> tuple[Refits, Model | None]:
    """Candidates refitted along the paths of the model, and the one that explains all that it leaves, where that is
    much. Others are then of interest only that explain about as much: what it should not have explained shows in the
    next round. Those that are imitated well imitate each other, and do not count.
    """
    refits, all_of_it = dict[str, Model | None](), None
    for s in close:
        most = gain_of(model, all_of_it)
        refits[s.effect] = refit = near(model, s, most)
        if refit is None or gain_of(model, refit) < max(CLEAR, most) or imitated(model, s) or not fit_left(refit).white:
            continue
        refits[s.effect] = refit = refit if white(refit) else refit.refitted()
        all_of_it = refit if white(refit) else all_of_it
    return refits, all_of_it


def _shown(model: Model, scores: Sequence[Score], refits: Refits, all_of_it: Model | None) -> list[Score]:
    """The candidates that are sought on chunks. What can be refitted along the paths of a model that leaves nothing,
    or of one that another explains, is sought only where that gains something, or about as much.
    """
    gain = {s.effect: gain_of(model, refits.get(s.effect)) for s in scores}
    promising = [s for i, s in enumerate(scores) if _promises(s, i, scores[0])]
    left = model.data.imposed or not white(model)
    if all_of_it is not None:
        most = gain_of(model, all_of_it)
        alike = [s for s in promising if max(s.gain, gain[s.effect]) > KEPT * most]  # a refit may have failed
        little = model.estimate.loss - all_of_it.estimate.loss < COMPLETE - 1  # as much may still be left unseen
        return [s for s in scores if s in alike or (left and little and imitated(model, s))]
    if not left:
        return [s for s in promising if imitated(model, s) or gain[s.effect] > PROSPECT]
    return [s for s in scores if s in promising or imitated(model, s) or model.estimate.loss > FAR_OFF]


def _promises(s: Score, place: int, best: Score) -> bool:
    """Whether a candidate promises as much as to be sought on chunks. place : by score."""
    return s.gain > SHOWN and (place < 2 or (place < TRIED and s.gain > PROMISING * best.gain))
