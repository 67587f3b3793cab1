"""A candidate fitted: on the base model's paths, on chunks of the recordings, and from there on all of them.

Here and below "base model" is the model of the round, which has the effects that were accepted before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identification.estimators.estimate import Estimate, handed_over, lean
from identification.tracing import settings
from identification.tracing.models.comparison import is_white
from identification.tracing.models.guesses import strengths
from identification.tracing.models.model import Model
from identification.tracing.models.promise import newton_step
from identification.tracing.models.search import continued, differ, first_fits
from identification.tracing.screen import Score


@dataclass(frozen=True)
class CandidateFit:
    """A candidate and its fits so far. chunk_fits : ends on chunks, the best and others not far behind it, empty where
    none was asked for or all diverged; gain : fall of the cost on chunks by the best of them, else that of the score;
    base_path_refit : its refit to whole recordings on the base model's paths, where there is one.
    """

    score: Score
    chunk_fits: tuple[Model, ...]
    gain: float
    base_path_refit: Model | None = None

    @property
    def effect(self) -> str:
        """The effect's id."""
        return self.score.effect


def gain_of(base: Model, refit: Model | None) -> float:
    """What a refit gains over the model without an effect; 0 where there is none."""
    return 0.0 if refit is None else base.cost - refit.cost


def explains_most(base: Model, refit: Model | None) -> bool:
    """Whether a refit leaves less of what is missing than it explains: another effect cannot explain as much, unless it
    explains the same.
    """
    if refit is None or base.data.imposed or gain_of(base, refit) < base.clear_gain:
        return False
    missing = base.estimate.loss - 1.0
    return base.estimate.loss - refit.estimate.loss > settings.GAIN_SHARE * missing


def gain_so_far(gains: Sequence[float], where: str = "") -> str:
    """The largest gain of those fitted so far, in words for the progress; empty where nothing is gained."""
    return f", best gain{where} {max(gains):.0f}" if any(gain > 0 for gain in gains) else ""


def fit_on_chunks(
    base: Model, base_on_chunks: Model | None, score: Score, from_here: bool, best_gain: float = 0.0, *,
    complete: bool = False,
) -> CandidateFit:  # fmt: skip
    """A candidate fitted to chunks, against the base model fitted to them, while it may come to something beside
    another that gains `best_gain` there. from_here : whether it also starts from the parameters of the base model;
    complete : whether one that leaves nothing is known.
    """
    first = first_fits(base, score.effect, values=score.values, guesses=score.guesses, from_here=from_here)
    if base_on_chunks is None or not first:
        return CandidateFit(score, (), score.gain)
    least = _enough_on_chunks(base, best_gain, complete)
    ends = continued(first, base_on_chunks.cost - least, clearly=complete and best_gain > base.clear_gain)
    gains = [gain_of(base_on_chunks, end) for end in ends]
    others = [
        end
        for end, gain in zip(ends[1:], gains[1:], strict=True)
        if gain > settings.GAIN_SHARE * gains[0] and differ(score.effect, end, ends[0])
    ]
    return CandidateFit(score, (ends[0], *others), gains[0])


def refit_on_base_paths(base: Model, score: Score, least: float = 0.0, on_chunks: Model | None = None) -> Model | None:
    """A candidate refitted on the base model's paths, for as long as it may come to something, and gain at least so
    much. New paths of a complete model cost hundreds more or less, in which what a weak effect gains is lost.
    on_chunks : the same on chunks, from which it starts where that is known.

    In damped order it starts from every shape that promises about as much: a local one leads to the next hollow only.
    """
    if on_chunks is not None:
        start = base.with_effect(score.effect, on_chunks.values, steps=settings.PATH_STEPS)
        return _refitted_from(start, _hopeless(base, least))
    others = () if base.data.damped is None else score.others
    best = _refit_of_shape(base, score, least)
    for values in others:
        further = _refit_of_shape(base, replace(score, values=values), max(least, gain_of(base, best)))
        best = max((best, further), key=lambda model: gain_of(base, model))
    return best


def _refit_of_shape(base: Model, score: Score, least: float) -> Model | None:
    """A candidate refitted on the base model's paths, from one shape.

    Where it can it starts from nothing: at the strength that the score promises, paths may already lead elsewhere. If
    that does not come to what the score says, it starts there, too. What promises nothing from nothing is not begun.
    """
    known, hopeless = strengths(base.data, score.effect), _hopeless(base, least)
    neutral = {n: p.neutral for n, p in known.items() if p.neutral is not None and p.lower < p.neutral}
    start = base.with_effect(score.effect, {**score.values, **neutral}, steps=settings.PATH_STEPS)
    from_nothing = len(neutral) == len(known)
    if start is not None and from_nothing and hopeless(start.estimate):
        return start
    first = _descended_from(start, hopeless) if from_nothing else _refitted_from(start, hopeless)
    if not neutral or gain_of(base, first) > score.gain:
        return first
    there = base.with_effect(score.effect, score.values, steps=settings.PATH_STEPS)
    second = _refitted_from(there, _hopeless(base, max(least, gain_of(base, first))))
    return first if gain_of(base, first) > gain_of(base, second) else second


def _hopeless(base: Model, least: float) -> Callable[[Estimate], bool]:
    """Whether an estimate of a candidate will come to nothing, or not gain as much as it should at least. What the base
    model promises by itself, and has not kept, promises nothing of the candidate.
    """
    empty = newton_step(base.estimate.normal)[1]

    def hopeless(now: Estimate) -> bool:
        gain = base.cost - now.cost
        promise = newton_step(now.normal)[1] - max(empty - max(gain, 0.0), 0.0)
        return (
            promise < settings.CHANCE_GAIN
            or gain + promise < settings.MIN_GAIN / 2
            or gain + settings.PROMISE_FACTOR * promise < least
        )

    return hopeless


def _refitted_from(start: Model | None, hopeless: Callable[[Estimate], bool]) -> Model | None:
    """A refit from a start on the base model's paths; None where they have no solution."""
    if start is None:
        return None
    work = start.data.estimator(start.effects, worth=settings.CHANCE_GAIN)
    end = work.refit(start.estimate.theta, start.estimate.paths, settings.STEPS, hopeless)
    return None if end is None else replace(start, estimate=lean(end))


def _descended_from(start: Model | None, hopeless: Callable[[Estimate], bool]) -> Model | None:
    """The same where the candidate is without effect at the start: the paths are the best of the base model's."""
    if start is None:
        return None
    work = start.data.estimator(start.effects, worth=settings.CHANCE_GAIN)
    begun = handed_over(work.along(start.estimate.theta, start.estimate.paths, 0))
    end = lean(work.descend(begun.pop(), settings.STEPS, hopeless)) if begun else None
    return start if end is None or end.cost > start.cost else replace(start, estimate=end)


def worth_refitting(base: Model, fits: Sequence[CandidateFit], *, complete: bool = False) -> dict[str, CandidateFit]:
    """Of fits to chunks, best first, those worth a refit to the whole recordings, by effect: not far behind the best,
    and likely to gain enough there. Likewise those whose refit on the base model's paths gains enough by itself.

    complete : whether one of them is accepted and leaves nothing, or explains most of what is missing, beside which
    only what explains as much counts.
    """
    count = settings.CANDIDATES if base.data.imposed else settings.CANDIDATES // 2
    on_chunks = [fit for fit in fits if fit.chunk_fits][:count]
    least = _enough_on_chunks(base, on_chunks[0].gain, complete) if on_chunks else 0.0
    best = max((gain_of(base, fit.base_path_refit) for fit in fits), default=0.0)
    enough = max(settings.MIN_GAIN, _near(base, best, settings.MIN_GAIN / 2, complete))
    near = sorted(fits, key=lambda fit: -gain_of(base, fit.base_path_refit))
    on_paths = {fit.effect: replace(fit, chunk_fits=()) for fit in near if gain_of(base, fit.base_path_refit) > enough}
    return on_paths | {fit.effect: fit for fit in on_chunks if fit.gain >= least}


def _near(base: Model, best_gain: float, little: float, complete: bool) -> float:
    """The gain from which a candidate is not far behind another. little : difference that does not count; complete : of
    `worth_refitting`.
    """
    if complete:
        return min(settings.EXPLAINED * best_gain, best_gain - little)
    return (settings.FAR_SHARE if base.data.imposed else settings.GAIN_SHARE) * best_gain


def _enough_on_chunks(base: Model, best_gain: float, complete: bool) -> float:
    """The gain on chunks below which a candidate is not refitted to whole recordings, beside another that gains
    `best_gain` there. complete : of `worth_refitting`.
    """
    little = settings.MIN_GAIN / 2 * base.data.chunk_share
    return max(_near(base, best_gain, little, complete), little)


def refitted(base: Model, fit: CandidateFit, least: float) -> Model | None:
    """The best refit of a candidate to the whole recordings: on chunks a worse end may look better. Each goes on while
    it may gain more than the others, and more than `least`. The one on the base model's paths is enough where it gains
    what chunks promise for the whole and leaves nothing.
    """
    near, others = fit.base_path_refit, fit.chunk_fits
    promised = bool(others) and gain_of(base, near) * base.data.chunk_share > fit.gain
    enough = near is not None and promised and is_white(near)
    best = near
    for end in () if enough else others:
        below = base.cost - max(least, gain_of(base, best))
        refit = end.refitted_beside(base, below)
        if refit is not None and (best is None or refit.cost < best.cost):
            best = refit
    return best
