"""A candidate judged: refitted to the fitted recordings, compared on those held out, and accepted or not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from identification.estimators.estimate import Estimate
from identification.tracing import settings
from identification.tracing.models.comparison import Comparison, compare, is_white
from identification.tracing.models.model import Model
from identification.tracing.refine import CandidateFit, gain_of, refitted
from identification.tracing.screen import Score


@dataclass(frozen=True)
class Candidate:
    """A candidate and what became of it.

    effect : its id; gain : fall of the cost on the fitted recordings, by refit or, where refit is None, by score or on
    chunks; values : its parameters by full name, SI units; refit : the model with it; held_out : the refit against the
    model without it on the held-out recordings; accepted, why : the decision and its reason in words; doubtful :
    accepted on the condition that as much is not gained by chance; chance : the probability that it is, from null
    replicates, None where none were made.
    """

    effect: str
    gain: float
    values: Mapping[str, float]
    refit: Model | None = None
    held_out: Comparison | None = None
    accepted: bool = False
    why: str = ""
    doubtful: bool = False
    chance: float | None = None


NO_SOLUTION = "the refit has no solution"
NO_TIME = "the budget of time was over before it was fitted"


def judge(base: Model, fit: CandidateFit) -> Candidate:
    """A candidate refitted to the whole recordings and judged on those held out."""
    effect, refit = fit.effect, refitted(base, fit, settings.MIN_GAIN)
    if refit is None or refit.held_out is None or base.held_out is None:
        return Candidate(effect, fit.gain, fit.score.values, why=NO_SOLUTION)
    fitted = compare(base.estimate, refit.estimate, base.data.fitted)
    held = compare(base.held_out, refit.held_out, base.data.held_out)
    values = {name: value for name, value in refit.values.items() if name in fit.score.values}
    shows, significant = fitted.gain > _min_gain(base, base.estimate), _is_significant(base, held)
    agrees = held.gain > _min_gain(base, base.held_out) - settings.MIN_GAIN
    explains = agrees and (significant or _is_enough_fitted(refit, fitted, held))
    needless = base.data.imposed and is_white(base)  # errors of the motion hold what an effect explains by chance
    why = (
        "nothing but noise is left without it" if needless
        else "gains too little on the fitted recordings" if not shows
        else f"explains held-out data (t = {held.t:.1f})" if agrees and significant
        else f"agrees with held-out data (t = {held.t:.1f})" if explains
        else f"does not explain held-out data (t = {held.t:.1f})"
    )  # fmt: skip
    accepted = shows and explains and not needless
    return Candidate(effect, fitted.gain, values, refit, held, accepted, why, doubtful=not significant)


def not_refitted(base: Model, fit: CandidateFit) -> Candidate:
    """A candidate whose fits did not make it worth a refit to the whole recordings."""
    near = fit.base_path_refit
    why = (
        "others explain more" if fit.chunk_fits or gain_of(base, near) > settings.MIN_GAIN
        else NO_SOLUTION if near is None
        else "gains too little on the fitted recordings"
    )  # fmt: skip
    return Candidate(fit.effect, fit.gain, fit.score.values, why=why)


def not_fitted(score: Score) -> Candidate:
    """A candidate that is not on the shortlist."""
    promises = score.gain > settings.MIN_GAIN / 2
    why = "others promise more" if promises else "hardly shows in the fitted recordings"
    return Candidate(score.effect, score.gain, score.values, why=why)


def judged_by_chance(c: Candidate, p: float) -> Candidate:
    """An accepted candidate, given the probability that as much is gained by chance."""
    if p == 1.0:
        return replace(c, accepted=False, chance=p, why="nothing says that as much is not gained by chance")
    if p > settings.LEVEL:
        return replace(c, accepted=False, chance=p, why=f"as much is gained where nothing is missing (p = {p:.2g})")
    return replace(c, chance=p, why=f"{c.why}, and as much is hardly gained by chance (p = {p:.2g})")


def _is_significant(base: Model, held: Comparison) -> bool:
    """Whether a held-out gain is one by itself. Blocks that differ by hundreds have no normal mean, so a gain that does
    not rest on a few of them is one, too.
    """
    level = settings.LEVEL if held.gain > settings.MIN_GAIN else settings.STRICT_LEVEL
    return held.p_value < level or (held.gain_elsewhere > settings.MIN_GAIN and not base.data.imposed)


def _is_enough_fitted(refit: Model, fitted: Comparison, held: Comparison) -> bool:
    """Whether a fitted gain is so large that held-out data need not show the effect beyond doubt, if chance does not
    gain as much: a few slips may hold all of it. They are explained a little better, or nothing is left of all data.
    """
    if refit.data.imposed or fitted.gain < settings.CLEAR_GAIN:
        return False
    return held.p_value < settings.LEVEL or is_white(refit)


def _min_gain(base: Model, estimate: Estimate) -> float:
    """The gain from which an effect counts, on the grids of an estimate of the base model."""
    if not base.data.imposed:
        return settings.MIN_GAIN
    if estimate.loss < settings.COMPLETE_LOSS:
        return float("inf")  # what a model gains below that, it gains from the allowance for blurred break-aways
    return settings.MIN_GAIN + settings.SMALL_SHARE * estimate.samples * max(estimate.loss - 1, 0.0)
