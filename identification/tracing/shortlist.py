"""Which candidates of a round are fitted, and how far: on the base model's paths, and to chunks of the recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from identification.budget import Budget
from identification.tracing import settings
from identification.tracing.models.comparison import fitted_whiteness, is_white
from identification.tracing.models.model import Model
from identification.tracing.models.search import best_model_on_chunks
from identification.tracing.refine import (
    CandidateFit,
    explains_most,
    fit_on_chunks,
    gain_of,
    gain_so_far,
    refit_on_base_paths,
)
from identification.tracing.screen import Score
from recordings import Progress, silent

Refits = Mapping[str, Model | None]
"""Refits on the base model's paths, by effect."""


def shortlisted_fits(
    base: Model, scores: Sequence[Score], complete: Callable[[], bool], budget: Budget, progress: Progress = silent
) -> Iterator[tuple[list[CandidateFit], list[Score]]]:
    """The candidates that are worth a fit, each fitted as far as it is worth, and those that come after them: some at a
    time, so that these can be judged before others are fitted. scores : best first; complete : whether one of those
    that were judged is accepted and leaves nothing.
    """
    few = [] if base.data.imposed else [s for s in scores if s.gain > settings.CHANCE_GAIN]
    refits, enough = _refits_on_base_paths(base, few, budget, progress)
    if enough is None and any(explains_most(base, refit) for refit in refits.values()):
        yield [CandidateFit(s, (), s.gain, refits[s.effect]) for s in few if s.effect in refits], list(scores)
    groups = _shortlist(base, scores, refits, enough)  # where slips are short this takes seconds
    base_on_chunks = best_model_on_chunks(base) if any(groups) else None
    usual = scores[: settings.CANDIDATES]
    known = [s for s in few if s.effect in refits and all(s not in group for group in groups)]
    fits, gains = [CandidateFit(s, (), s.gain) for s in known], list[float]()
    for i, group in enumerate(groups):
        for s in budget.within(group, "fits to chunks", progress, _effect, partial(gain_so_far, gains, " on chunks")):
            from_here = s in usual or is_imitated(base, s)
            nothing_left = enough is not None or complete()
            best_gain = max((0.0, *gains))
            fits.append(fit_on_chunks(base, base_on_chunks, s, from_here, best_gain, complete=nothing_left))
            gains.append(fits[-1].gain if fits[-1].chunk_fits else 0.0)
        late = [CandidateFit(s, (), s.gain) for s in group if all(fit.score is not s for fit in fits)]
        so_far = [replace(fit, base_path_refit=refits.get(fit.effect)) for fit in (*fits, *late)]
        yield so_far, [s for later in groups[i + 1 :] for s in later]
        fits = []


def is_imitated(base: Model, score: Score) -> bool:
    """Whether a model imitates an effect so well that its score says little and its own paths do not lead to it."""
    return not base.data.imposed and base.data.catalogue[score.effect].imitated


def _effect(score: Score) -> str:
    return score.effect


def _refits_on_base_paths(
    base: Model, few: Sequence[Score], budget: Budget, progress: Progress
) -> tuple[Refits, Model | None]:
    """Candidates refitted on the base model's paths, and the one of them that is complete, where it gains much.

    Others are then of interest only if they explain about as much: what it should not have explained shows in the next
    round. Effects that the base model imitates well also imitate each other, and none of them ends the search.
    """
    refits, complete, gains, beside = dict[str, Model | None](), None, list[float](), 0.0
    stage, small = "refits on the base model's paths", _share_that_shows(base, few)
    ends = {} if small is None else _refits_on_chunks(small, few, base.data.chunk_share, budget, progress)
    near = few if small is None else [s for effect in ends for s in few if s.effect == effect]
    for s in budget.within(near, stage, progress, _effect, partial(gain_so_far, gains)):
        most = any(explains_most(base, refit) for refit in refits.values())
        share = settings.EXPLAINED if most or complete is not None else settings.GAIN_SHARE
        if small is None and settings.PROMISE_FACTOR * s.gain < share * beside:
            break
        refits[s.effect] = refit = refit_on_base_paths(base, s, share * beside, ends.get(s.effect))
        gain, earlier = gain_of(base, refit), max((0.0, *gains))
        gains.append(gain)
        if gain > earlier:  # scores that promised the best too little promise others too little
            beside = min(gain, settings.PROMISE_FACTOR * s.gain)
        if refit is None or gain < max(settings.CLEAR_GAIN, earlier):
            continue
        if is_imitated(base, s) or not fitted_whiteness(refit).white:
            continue
        refits[s.effect] = refit = refit if is_white(refit) else refit.refitted()
        gains.append(gain_of(base, refit))
        complete = refit if is_white(refit) else complete
    return refits, complete


def _share_that_shows(base: Model, few: Sequence[Score]) -> Model | None:
    """The base model on chunks of the recordings, where scores promise so much that these show it beyond doubt. In
    damped order paths are new at every step, and chunks save little.
    """
    if not few or base.data.damped is not None or few[0].gain * base.data.chunk_share < base.clear_gain:
        return None
    return base.on_chunks()


def _refits_on_chunks(
    small: Model, few: Sequence[Score], share: float, budget: Budget, progress: Progress
) -> dict[str, Model]:
    """Candidates refitted on the paths of the base model on chunks, those not far behind the best, best first. share :
    of the recordings that is in chunks.
    """
    found, gains, beside = list[tuple[str, Model]](), list[float](), 0.0
    for s in budget.within(few, "refits on its paths in chunks", progress, _effect, partial(gain_so_far, gains)):
        promise = share * settings.PROMISE_FACTOR * s.gain
        if promise < settings.GAIN_SHARE * beside:
            break
        refit = refit_on_base_paths(small, replace(s, gain=share * s.gain), settings.GAIN_SHARE * beside)
        gain = gain_of(small, refit)
        beside = max(beside, min(gain, promise))
        found += [] if refit is None else [(s.effect, refit)]
        gains.append(gain)
    enough = max(settings.GAIN_SHARE * max(gains, default=0.0), share * settings.MIN_GAIN / 2)
    near = sorted(found, key=lambda one: one[1].cost)
    return {effect: refit for effect, refit in near if gain_of(small, refit) > enough}


def _shortlist(
    base: Model, scores: Sequence[Score], refits: Refits, complete: Model | None
) -> list[list[Score]]:  # fmt: skip
    """The candidates that are fitted to chunks, in groups, each of which is only fitted if nothing complete is in those
    before it. Those that can be refitted on the paths of a complete base model, or beside a complete candidate, are so
    only where that gains something, or about as much.
    """
    gain = {s.effect: gain_of(base, refits.get(s.effect)) for s in scores}
    promising = [s for place, s in enumerate(scores) if _promises(s, place, scores[0])]
    if complete is not None:
        enough = settings.GAIN_SHARE * gain_of(base, complete)
        # a refit may have failed, but hardly one that looked for new paths
        alike = [s for s in promising if base.data.damped is None and max(s.gain, gain[s.effect]) > enough]
        fall = base.estimate.loss - complete.estimate.loss
        # as much may still be missing unseen
        unclear = fall < settings.COMPLETE_LOSS - 1 and (base.data.imposed or not is_white(base))
        return [[s for s in scores if s in alike or (unclear and is_imitated(base, s))]]
    white = is_white(base)
    if white and not base.data.imposed:
        return [[s for s in promising if is_imitated(base, s) or gain[s.effect] > settings.MIN_GAIN / 2]]
    imitated = [s for s in scores if is_imitated(base, s) and s not in promising]
    others = [s for s in scores if s not in promising and not (white or s in imitated)]
    if base.data.damped is None:
        return [[s for s in scores if s in promising or s in imitated], others]
    half = settings.CANDIDATES // 2  # here fits cost most
    return [group for group in (promising[:half], promising[half:], imitated, others) if group]


def _promises(score: Score, place: int, best: Score) -> bool:
    """Whether a candidate promises as much as to be fitted to chunks. place : by score, from 0."""
    if score.gain <= settings.MIN_GAIN / 2:
        return False
    near = place < settings.CANDIDATES and score.gain > settings.FAR_SHARE * best.gain
    return near or place < settings.AT_LEAST
