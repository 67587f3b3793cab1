"""From a loop to its assessment: data first, then oscillation, methods, one answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identification.loops.amounts import amounts, stem_amounts
from identification.loops.assessment import Assessment, OtherCause
from identification.loops.data_problems import DataProblem, data_problems
from identification.loops.evidence import evidence, of_search
from identification.loops.forces import friction_forces, full_force
from identification.loops.joint import joint_posterior
from identification.loops.loop import ControlLoop
from identification.loops.methods import (
    METHODS,
    HammersteinFit,
    MethodAnswer,
    StictionSearch,
    hammerstein_answer,
    search,
)
from identification.loops.oscillation import Oscillation, oscillations
from identification.loops.preparation import prepared
from identification.loops.verdict import speaks_for, table_of, verdict, weighed
from recordings import Array


@dataclass(frozen=True)
class LoopFindings:
    """What the methods and the search say of a loop with the strongest oscillation.

    period : of that oscillation [samples]; whole : whether the data show the shape of the signals; else only the search
    has an answer.
    """

    loop: ControlLoop
    period: float | None
    answers: tuple[MethodAnswer, ...]
    tried: StictionSearch
    weights: Array
    whole: bool


def findings(loop: ControlLoop, found: tuple[Oscillation, ...], problems: tuple[DataProblem, ...]) -> LoopFindings:
    """Every method's answer for a loop."""
    oscillation = found[0] if found else None
    tried = search(loop, _period(loop, found))
    ready = prepared(loop, oscillation.period_s) if oscillation else None
    answers = (*(method(ready) for method in METHODS if ready), hammerstein_answer(tried))
    weights, whole = (
        evidence(answers, tried, oscillation, loop.op_percent),
        not any(one.hides == "shape" for one in problems),
    )
    return LoopFindings(loop, _period(loop, found), answers, tried, weights if whole else of_search(weights), whole)


def loop_findings(loop: ControlLoop) -> LoopFindings | None:
    """What the methods say of a loop; None where the data cannot carry an answer."""
    found = oscillations(loop)
    problems = data_problems(loop, found)
    if any(one.hides == "everything" for one in problems):
        return None
    return findings(loop, found, problems)


def told_by_place(loop: ControlLoop, place: Array) -> tuple[float, float]:
    """How far a loop whose valve has known places (n,), in % of its travel, can be told from one without friction, and
    from one with backlash: twice the logarithms of the likelihoods over those of the rivals."""
    fit = HammersteinFit.of(loop, _period(loop, oscillations(loop)))
    return fit.told_by(place - place.mean() + loop.op.mean())


def assess_loop(
    loop: ControlLoop, guesses: tuple[str, ...] = (), valve: Mapping[str, float] | None = None
) -> Assessment:
    """Assess a loop. Where the data hide the shape of the signals, only the search for S and J has a say: the answer
    is `stiction` or `cannot_tell`. Where they hide more, it is `cannot_tell`.

    valve : data of the valve by the names of `forces.ITEMS`, for friction in N.
    """
    full = full_force(valve) if valve else None
    found = oscillations(loop)
    problems = data_problems(loop, found)
    limits = "; ".join(one.words for one in problems if one.hides != "nothing")
    saturation = {one.cause: OtherCause(1.0, (one.words,)) for one in problems if one.cause}
    seen = findings(loop, found, problems)
    if any(one.hides == "everything" for one in problems):
        return Assessment("cannot_tell", None, limits, loop, problems, guesses, found, None, saturation, seen.answers)
    table = table_of(loop.integrating, seen.whole)
    causes, speaks = weighed(seen.weights, table), speaks_for(seen.weights, table)
    probability = causes.pop("stiction")
    answer = verdict(probability, causes["backlash"])
    if not seen.whole and answer != "stiction":
        return Assessment("cannot_tell", None, limits, loop, problems, guesses, found, None, saturation, seen.answers)
    found_else = {name: OtherCause(value, speaks[name]) for name, value in causes.items()} | saturation
    others = dict(sorted(found_else.items(), key=lambda one: -one[1].probability))
    says = {word: [one.method for one in seen.answers if one.says == word] for word in ("stiction", "no_stiction")}
    why = f"for stiction: {_list(says['stiction'])}; against: {_list(says['no_stiction'])}"
    why = why if seen.whole else f"by the search for S and J alone, as {limits}"
    amount = amounts(seen.tried) if answer == "stiction" and loop.op_percent else None
    stem = stem_amounts(seen.tried) if amount and full else None
    forces = friction_forces(stem, full) if stem and full else None
    joint = None
    if stem and forces:
        joint = joint_posterior(loop, _period(loop, found), seen.tried.best, stem.possible, forces)
    return Assessment(
        answer, probability, why, loop, problems, guesses, found, amount, others, seen.answers, forces, joint
    )


def _period(loop: ControlLoop, found: tuple[Oscillation, ...]) -> float | None:
    """Of the strongest oscillation [samples]."""
    return found[0].period_s / loop.dt if found else None


def _list(names: list[str]) -> str:
    return ", ".join(names) or "no method"
