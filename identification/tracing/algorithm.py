"""Close the loop: fit, look at what is left, name what the model lacks, add it, and judge on held-out data.

Forward selection by score test, refit and held-out judgement, one effect at a time. Nothing is accepted for fitting
better: an effect has to explain recordings that were not fitted, and a name is given only when with it hardly
anything is left. Otherwise the answer is `none` (nothing was left) or `unlisted` (no candidate explains it).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.experiment import Experiment, experiment
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from identification.estimators.feasibility import check_given, obstacle
from identification.procedure import plant_constants
from identification.tracing.base import first_model, fit_left, held_left, settled, split, stiffened, white
from identification.tracing.judge import COMPLETE, Comparison, Whiteness, compare
from identification.tracing.model import Model
from identification.tracing.null_bootstrap import BY_CHANCE, CLEAR, chance
from identification.tracing.refine import KEPT, Begun, gain_of, refitted
from identification.tracing.screen import Score, screen
from identification.tracing.shortlist import SHOWN, looked
from identification.tracing.swap import exchanged, size
from recordings import BadInput, NegativeAnswer, Recording
from simulator import BASE, kernel

FULLY = 4
"""How many candidates are refitted to the whole at most."""
KEPT_IMPOSED, FULLY_IMPOSED = 0.2, 8
"""The same, and `KEPT`, where the force is predicted, which costs little."""
LIKELY = 0.5
"""Share of `WORTH` that a candidate must gain on chunks, for as much as they are of the recordings."""
MOST = 3
"""Effects that are added at most."""
WORTH = 60.0
"""Fall of the cost on the fitted recordings below which nothing is accepted, whatever its significance."""
LEVEL, CLEAR_LEVEL = 5e-3, 0.05
"""Levels of the held-out test over blocks, which only candidates that clearly show in the fitted recordings reach. An
effect that acts in a few places has few blocks to show itself in: where the held-out cost falls by `WORTH` as well, the
second level is enough, and where it does so beside the best few blocks, none is asked: blocks that differ by hundreds
have no normal mean. What gains `CLEAR` on the fitted ones may reach the second level alone, if as much is not gained by
chance. (Where the force is predicted, every block is far from noise, and such a fall says little.)"""
EXPLAINED, EXPLAINED_FIT = 0.8, 0.5
"""Shares of what is left over a complete model's, on held-out and on fitted recordings, that effects have to explain
for one to be named."""
ALONE, TOGETHER = 1.25, 1.1
"""Mean held-out loss up to which one effect, or several, are named. A share of much may still be much, and several
effects can imitate one that is not known here, but not to the noise."""
EXPLAINED_IMPOSED = 0.25
"""The same share where the force is predicted from the motion. What a rig's force holds beside a model never comes near
its noise, and no free run amplifies what is left; the rest is reported beside the name."""
NOTABLE = 0.05
"""Share of what is left there that an effect has to explain, fitted and held out, to be added."""
ALIKE = 0.05
"""Candidates whose gains differ by less than this share, or insignificantly, are one class: what a valve has is never
quite of the form that a candidate has, which costs as much."""
NO_SOLUTION = "the refit has no solution"
INSIGNIFICANT = 2.0
"""Student's t below which two candidates explain held-out data alike."""


@dataclass(frozen=True)
class Candidate:
    """A candidate and what became of it. gain : fall of the cost on the fitted recordings, by refit or, where refit is
    None, by score; held : against the model without it on held-out data; why : in words; doubtful : accepted, if as
    much is not gained by chance.
    """

    effect: str
    gain: float
    values: Mapping[str, float]
    refit: Model | None = None
    held: Comparison | None = None
    accepted: bool = False
    why: str = ""
    doubtful: bool = False


@dataclass(frozen=True)
class Tracing:
    """Everything a trace found. base, final : models; candidates : of the first round, best first; added : effects in
    the order of acceptance; same_class : effects these recordings cannot tell from the first; verdict : an effect id,
    ``none`` or ``unlisted``; before, after : whiteness on the held-out data.
    """

    base: Model
    final: Model
    candidates: tuple[Candidate, ...]
    added: tuple[str, ...]
    same_class: tuple[str, ...]
    verdict: str
    before: Whiteness
    after: Whiteness

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """The experiments that were fitted."""
        return self.base.data.recorded[0]

    @property
    def held(self) -> tuple[Experiment, ...]:
        """The experiments that were held out."""
        return self.base.data.recorded[1]

    @property
    def only_held(self) -> bool:
        """Whether something is left on the held-out recordings alone."""
        return fit_left(self.final).white and not self.after.white


def select(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    given: Mapping[str, float] | None = None,
    hold: bool = False,
) -> Tracing:
    """Trace what a base model lacks. Raises BadInput for recordings that cannot be used, NegativeAnswer when the base
    model cannot be fitted at all.
    """
    experiments = [experiment(r, hold=hold) for r in recordings]
    others = [experiment(r, hold=hold) for r in holdout]
    if len({e.causality for e in (*experiments, *others)}) != 1:
        raise BadInput("recordings", "in some the force drives and in some the motion", "trace them separately")
    if not others:
        experiments, others = split(experiments)
    held = plant_constants(experiments) | dict(given or {})
    _check(experiments, held)
    base = first_model(experiments, others, held)
    base, model, added, rounds = _selected(base)
    first, alike = rounds[0], tuple[str, ...]()
    if len(added) == 1:
        first, alike = _alone(first, added[0])
    elif added:
        beside, earlier = {r[0].effect: [c for c in r[1:] if c.refit is not None] for r in rounds}, added
        model, added, alike = exchanged(model, added, beside, WORTH)
        first = _in_the_end(first, earlier, added)
    verdict, added, model = _verdict(base, model, added)
    return Tracing(
        base, model, first, added, alike if added else (), verdict, held_left(base), held_left(model)
    )  # fmt: skip


def _check(experiments: Sequence[Experiment], given: Mapping[str, float]) -> None:
    """Raise BadInput or NegativeAnswer for what no fit could be made with, before any work is done."""
    valve, force = kernel(BASE), np.concatenate([s.u for e in experiments for s in e.segments])
    check_given(given, valve)
    hindered = obstacle(experiments, Coordinates.of(valve, given, float(np.std(force)) or 1.0), force)
    if hindered is not None:
        raise NegativeAnswer(hindered.value)


def _selected(base: Model) -> tuple[Model, Model, tuple[str, ...], list[tuple[Candidate, ...]]]:
    """Forward selection from the base: the base, the model, the effects added, and the candidates of every round.

    An effect may only have shown the way to a better end of the base model, which is then the base to begin from.
    """
    model, added, rounds = base, tuple[str, ...](), list[tuple[Candidate, ...]]()
    while len(added) < MOST:
        rounds.append(judged(model))
        best = rounds[-1][0]
        if not best.accepted or best.refit is None:
            break
        before, earlier = model, added
        model, added = _pruned(settled(stiffened(best.refit)), (*added, best.effect))
        if not added:
            better = stiffened(settled(model))
            return _selected(better) if better.estimate.cost < base.estimate.cost else (base, base, (), rounds)
        if set(added) <= set(earlier):
            break
        p = chance(before, best.refit, best.effect, best.doubtful)
        if p is None:
            continue
        rounds[-1] = (_held_against_twins(best, p), *rounds[-1][1:])
        if not rounds[-1][0].accepted:
            model, added = before, earlier
            break
    return base, model, added, rounds


def _held_against_twins(c: Candidate, p: float) -> Candidate:
    """A candidate that was accepted, by the probability that as much is gained by chance."""
    if p > BY_CHANCE:
        return replace(c, accepted=False, why=f"as much is gained where nothing is missing (p = {p:.2g})")
    return replace(c, why=f"{c.why}, and as much is hardly gained by chance (p = {p:.2g})")


def _pruned(model: Model, added: tuple[str, ...]) -> tuple[Model, tuple[str, ...]]:
    """The model without what it does not need: an effect that was added before a better one, or one whose gain came of
    fitting the others better.
    """
    for effect in added:
        other = model.without(effect)
        if other is not None and other.estimate.cost < model.estimate.cost + WORTH:
            return _pruned(other, tuple(e for e in added if e != effect))
    return model, added


def judged(model: Model) -> tuple[Candidate, ...]:
    """The candidates of one round: all by score, the best sought on chunks or along the paths of the model, and those
    that then explain most refitted and judged on the held-out grids.
    """
    scores = screen(model)
    seen = sorted(looked(model, scores), key=lambda b: -b.gain if b.ends else np.inf)
    promising = _promising(model, seen)
    tried = [
        _ended(model, promising[b.score.effect]) if b.score.effect in promising else
        Candidate(b.score.effect, b.gain, b.score.values, why=_given_up(b))
        for b in seen
    ]  # fmt: skip
    ranked = sorted(tried, key=lambda c: (not c.accepted, -(c.gain + (c.held.gain if c.held else 0.0))))
    rest = [s for s in scores if all(b.score is not s for b in seen)]
    return tuple(_simplest_first(ranked) + [Candidate(s.effect, s.gain, s.values, why=_passed_over(s)) for s in rest])


def _passed_over(s: Score) -> str:
    """Why a candidate is not looked at."""
    return "others promise more" if s.gain > SHOWN else "hardly shows in the fitted recordings"


def _given_up(b: Begun) -> str:
    """Why a candidate is not refitted to the whole."""
    if b.ends:
        return "others explain more"
    return NO_SOLUTION if b.near is None else "gains too little on the fitted recordings"


def _promising(model: Model, seen: Sequence[Begun]) -> dict[str, Begun]:
    """Of candidates on chunks, best first, those worth being refitted to the whole recordings, by effect: not far
    behind the best, and likely to gain enough there; and likewise of those along the paths of the model.
    """
    kept, fully = (KEPT_IMPOSED, FULLY_IMPOSED) if model.data.imposed else (KEPT, FULLY)
    sought = [b for b in seen if b.ends][:fully]
    least = max(kept * sought[0].gain, LIKELY * WORTH * model.data.in_chunks) if sought else 0.0
    most = max((gain_of(model, b.near) for b in seen), default=0.0)
    nearby = {b.score.effect: replace(b, ends=()) for b in seen if gain_of(model, b.near) > max(WORTH, kept * most)}
    return nearby | {b.score.effect: b for b in sought if b.gain >= least}


def _ended(model: Model, b: Begun) -> Candidate:
    """A candidate refitted to the whole recordings and judged."""
    effect, refit = b.score.effect, refitted(model, b)
    if refit is None or refit.held is None or model.held is None:
        return Candidate(effect, b.gain, b.score.values, why=NO_SOLUTION)
    fitted = compare(model.estimate, refit.estimate, model.data.fitted)
    held = compare(model.held, refit.held, model.data.held)
    values = {name: value for name, value in refit.values.items() if name in b.score.values}
    shows = fitted.gain > _least(model, model.estimate)
    steady = _steady(model, held)
    clear = fitted.gain > CLEAR and held.p_value < CLEAR_LEVEL and not model.data.imposed
    enough = shows and held.gain > _least(model, model.held) - WORTH and (steady or clear)
    why = (
        f"explains held-out data (t = {held.t:.1f})" if enough
        else "gains too little on the fitted recordings" if not shows
        else f"does not explain held-out data (t = {held.t:.1f})"
    )  # fmt: skip
    return Candidate(effect, fitted.gain, values, refit, held, enough, why, doubtful=not steady)


def _steady(model: Model, held: Comparison) -> bool:
    """Whether a held-out gain is one by itself."""
    level = CLEAR_LEVEL if held.gain > WORTH else LEVEL
    return held.p_value < level or (held.elsewhere > WORTH and not model.data.imposed)


def _least(model: Model, estimate: Estimate) -> float:
    """Fall of the cost that an effect is worth, on the grids of an estimate of a model."""
    if not model.data.imposed:
        return WORTH
    return WORTH + NOTABLE * estimate.samples * max(estimate.loss - 1, 0.0)


def _simplest_first(ranked: list[Candidate]) -> list[Candidate]:
    """Of the accepted candidates only one is added: of those that explain as much as the best, the simplest."""
    accepted = [c for c in ranked if c.accepted]
    if not accepted:
        return ranked
    alike = same_class(accepted)
    first = min((c for c in accepted if c is accepted[0] or c.effect in alike), key=lambda c: size(c.effect))
    others = [
        replace(c, accepted=False, why=f"cannot be told from {first.effect}" if c.effect in (*alike, accepted[0].effect)
                else "explains less than the one accepted") if c.accepted else c
        for c in ranked if c is not first
    ]  # fmt: skip
    return [first, *others]


def _alone(candidates: Sequence[Candidate], effect: str) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """The candidates of the first round where one effect is left, and what cannot be told from it. It may have been
    found beside the one that was taken first, which is then not needed.
    """
    first = candidates[0].effect
    alike = (first, *same_class(candidates))
    others = tuple(e for e in alike if e != effect) if effect in alike else ()
    return _in_the_end(candidates, (first,), (effect,)), others


def _in_the_end(
    candidates: Sequence[Candidate], earlier: tuple[str, ...], added: tuple[str, ...]
) -> tuple[Candidate, ...]:
    """The candidates of the first round as later ones left them, those that were taken first."""
    left = [
        replace(c, accepted=False, why="another does as well or better in the end")
        if c.accepted and c.effect not in added
        else replace(c, accepted=True, why="does best in the end")
        if c.effect in added and c.effect not in earlier
        else c
        for c in candidates
    ]
    return tuple(sorted(left, key=lambda c: not c.accepted))


def same_class(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """The candidates that explain the held-out data as well as the first."""
    best, found = candidates[0], []
    assert best.held is not None
    assert best.refit is not None
    for c in candidates[1:]:
        if c.held is None or c.refit is None or c.held.gain <= 0:
            continue
        near = (
            abs(c.held.gain - best.held.gain) < ALIKE * abs(best.held.gain)
            and abs(c.gain - best.gain) < ALIKE * best.gain
        )
        assert best.refit.held is not None
        assert c.refit.held is not None
        against = compare(c.refit.held, best.refit.held, best.refit.data.held)
        if near or (abs(against.t) < INSIGNIFICANT and abs(c.gain - best.gain) < WORTH / 3):
            found.append(c.effect)
    return tuple(found)


def _verdict(base: Model, model: Model, added: tuple[str, ...]) -> tuple[str, tuple[str, ...], Model]:
    """The verdict: a name only when little is left with it, on the held-out grids above all."""
    if not added:
        return ("none" if white(base) else "unlisted"), (), base
    held, fitted = (EXPLAINED_IMPOSED,) * 2 if base.data.imposed else (EXPLAINED, EXPLAINED_FIT)
    most = np.inf if base.data.imposed else ALONE if len(added) == 1 else TOGETHER
    before, after = held_left(base), held_left(model)
    named = _explained(before, after, held) and _explained(fit_left(base), fit_left(model), fitted)
    return (added[0], added, model) if named and after.loss < most else ("unlisted", (), base)


def _explained(before: Whiteness, after: Whiteness, share: float) -> bool:
    """Whether that share of what was left over what a complete model leaves is gone, or nothing is left."""
    return after.white or after.loss - COMPLETE < (1.0 - share) * (before.loss - COMPLETE)
