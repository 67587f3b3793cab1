"""All candidates of one round: screened, fitted as far as each is worth, judged and ranked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identification.budget import Budget
from identification.tracing import settings
from identification.tracing.classes import ranked
from identification.tracing.judge import NO_TIME, Candidate, judge, not_fitted, not_refitted
from identification.tracing.models.comparison import is_white
from identification.tracing.models.model import Model
from identification.tracing.refine import CandidateFit, explains_most, gain_of, gain_so_far, worth_refitting
from identification.tracing.screen import Score, screen
from identification.tracing.several import n_free_parameters
from identification.tracing.shortlist import shortlisted_fits
from recordings import Progress, silent
from simulator import BASE


def candidates_of_round(model: Model, budget: Budget, progress: Progress = silent) -> tuple[Candidate, ...]:
    """All candidates beside a model, best first; at most the first is accepted."""
    scores, fits, judged = screen(model, progress), list[CandidateFit](), dict[str, Candidate]()

    def complete() -> bool:
        return any(_is_complete(c) for c in judged.values())

    for some, rest in shortlisted_fits(model, _worth_a_fit(model, scores), complete, budget, progress):
        further = {fit.effect for fit in some}  # fitted further than those of the same effects before, or first
        fits = [*(fit for fit in fits if fit.effect not in further), *some]
        fits.sort(key=lambda fit: -fit.gain if fit.chunk_fits else np.inf)
        judged = {effect: c for effect, c in judged.items() if effect not in further}
        judged |= _judged(model, fits, judged, budget, progress)
        if any(_is_enough(model, c, rest) for c in judged.values()) or in_wrong_order(judged.values()):
            break
    if not any(c.accepted for c in judged.values()) and not in_wrong_order(judged.values()):
        # what held-out data reject is no measure for the others
        left = [fit for fit in fits if fit.effect not in judged]
        judged |= _judged(model, left, judged, budget, progress)
    judged |= {fit.effect: judge(model, fit) for fit in _best_in_time(model, fits, budget) if fit.effect not in judged}
    known = [judged.get(fit.effect) or not_refitted(model, fit) for fit in fits]
    others = [not_fitted(s) for s in scores if all(fit.score is not s for fit in fits)]
    found = (*ranked(known, model.data.catalogue), *others)
    return tuple(replace(c, why=NO_TIME) if _is_late(c, budget) else c for c in found)


def _worth_a_fit(model: Model, scores: list[Score]) -> list[Score]:
    """The scores that are worth a fit: beside effects that leave nothing only what may gain so much that it is beyond
    doubt, for they never have quite the form of what is there, and others that fit the rest gain hundreds. Scores are
    taken on the model's own paths, so ends on other paths, which gain more where the sampling does not resolve the
    bristle, play no part in them.
    """
    if not _leaves_nothing(model):
        return scores
    return [s for s in scores if settings.PROMISE_FACTOR * s.gain > settings.CLEAR_GAIN]


def _leaves_nothing(model: Model) -> bool:
    """Whether a model has effects beside the base, and they leave nothing."""
    return not (model.data.imposed or set(model.effects) <= set(BASE)) and is_white(model)


def _judged(
    model: Model, fits: Sequence[CandidateFit], known: Mapping[str, Candidate], budget: Budget, progress: Progress
) -> dict[str, Candidate]:
    """Those of some fits judged that are worth a refit beside each other and not known yet, one after the other: beside
    one that leaves nothing few others are.
    """
    found = dict[str, Candidate]()

    def worth() -> list[CandidateFit]:
        complete = any(_is_enough(model, c, ()) for c in (*known.values(), *found.values()))
        return [fit for effect, fit in worth_refitting(model, fits, complete=complete).items() if effect not in known]

    gains = [c.gain for c in known.values() if c.refit is not None]
    for fit in budget.within(
        worth(), "refits and hold-out", progress, lambda fit: fit.effect, partial(gain_so_far, gains)
    ):
        if any(fit.effect == one.effect for one in worth()):
            found[fit.effect] = new = judge(model, fit)
            gains += [] if new.refit is None else [new.gain]
    return found


def in_wrong_order(candidates: Iterable[Candidate]) -> bool:
    """Whether the best refit of candidates of damped order shows that the sampling resolves the bristle, which a base
    model that lacks much could not tell. An accepted one that leaves nothing is right in either order.
    """
    refits = [c.refit for c in candidates if c.refit is not None]
    best = min(refits, key=lambda refit: refit.cost, default=None)
    return best is not None and best.shows_the_swing and not any(_is_complete(c) for c in candidates)


def _best_in_time(model: Model, fits: Sequence[CandidateFit], budget: Budget) -> list[CandidateFit]:
    """Where the time is over, the best refit on the base model's paths, and the simplest of those that gain about as
    much: it is there, and only has to be judged.
    """
    gains = [(gain_of(model, fit.base_path_refit), fit) for fit in fits if fit.base_path_refit is not None]
    if not budget.over or not gains:
        return []
    enough = max(gain for gain, _ in gains) - settings.MIN_GAIN
    near = [fit for gain, fit in gains if gain > enough]
    return [replace(min(near, key=lambda fit: n_free_parameters(fit.effect, model.data.catalogue)), chunk_fits=())]


def _is_late(c: Candidate, budget: Budget) -> bool:
    """Whether the time was over before a candidate was judged."""
    return c.refit is None and c.effect in budget.not_tried


def _is_enough(model: Model, c: Candidate, rest: Sequence[Score]) -> bool:
    """Whether the rest need not be fitted beside a candidate: it is accepted and leaves nothing, or explains most of
    what is missing beyond doubt. What explains most, too, stands for the same and is tried in its place at the end, and
    what explains the rest shows better beside it. What the base model imitates imitates each other, too, so one of
    those is not enough while others are among the rest.
    """
    if c.refit is None or not (_is_complete(c) or (c.accepted and not c.doubtful and explains_most(model, c.refit))):
        return False
    catalogue = c.refit.data.catalogue
    return not (catalogue[c.effect].imitated and any(catalogue[s.effect].imitated for s in rest))


def _is_complete(c: Candidate) -> bool:
    """Whether a candidate is accepted and leaves nothing."""
    return c.accepted and c.refit is not None and is_white(c.refit)
