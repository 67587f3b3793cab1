"""From a loop to its assessment: data first, then oscillation, methods, one answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identification.loops.amounts import amounts
from identification.loops.assessment import Assessment
from identification.loops.data_problems import data_problems
from identification.loops.evidence import evidence
from identification.loops.forces import friction_forces, full_force
from identification.loops.loop import ControlLoop
from identification.loops.methods import METHODS, MethodAnswer, StictionSearch, hammerstein_answer, search
from identification.loops.oscillation import Oscillation, oscillations
from identification.loops.preparation import prepared
from identification.loops.verdict import verdict, weighed
from recordings import Array


@dataclass(frozen=True)
class LoopFindings:
    """What the methods and the search say of a loop with the strongest oscillation; op_scale : of `tried`."""

    answers: tuple[MethodAnswer, ...]
    tried: StictionSearch
    op_scale: float
    weights: Array


def findings(loop: ControlLoop, oscillation: Oscillation) -> LoopFindings:
    """Every method's answer for a loop."""
    ready = prepared(loop, oscillation.period_s)
    tried = search(ready.fine)
    answers = (*(method(ready.cycles) for method in METHODS), hammerstein_answer(tried))
    return LoopFindings(answers, tried, ready.op_scale, evidence(answers, tried, oscillation))


def loop_evidence(loop: ControlLoop) -> Array | None:
    """The evidence of a loop, (k,); None where the data cannot carry an answer."""
    found = oscillations(loop)
    if not found or any(one.limits for one in data_problems(loop, found)):
        return None
    return findings(loop, found[0]).weights


def assess_loop(
    loop: ControlLoop, guesses: tuple[str, ...] = (), valve: Mapping[str, float] | None = None
) -> Assessment:
    """Assess a loop. A fault of the data that hides what the methods look at makes the answer `cannot_tell`.

    valve : data of the valve by the names of `forces.ITEMS`, for friction in N.
    """
    full = full_force(valve) if valve else None
    found = oscillations(loop)
    problems = data_problems(loop, found)
    limits = [one.words for one in problems if one.limits]
    saturation = {one.cause: 1.0 for one in problems if one.cause}
    if not found:
        why = "; ".join([*limits, "the loop does not oscillate regularly"])
        return Assessment("cannot_tell", None, why, loop, problems, guesses, found, None, saturation, ())
    seen = findings(loop, found[0])
    if limits:
        why = "; ".join(limits)
        return Assessment("cannot_tell", None, why, loop, problems, guesses, found, None, saturation, seen.answers)
    causes = weighed(seen.weights, loop.integrating)
    probability = causes.pop("stiction")
    others = dict(sorted({**causes, **saturation}.items(), key=lambda one: -one[1]))
    answer = verdict(probability)
    says = {word: [one.method for one in seen.answers if one.says == word] for word in ("stiction", "no_stiction")}
    why = f"for stiction: {_list(says['stiction'])}; against: {_list(says['no_stiction'])}"
    amount = amounts(seen.tried, seen.op_scale) if answer == "stiction" and loop.op_percent else None
    forces = friction_forces(amount, full) if amount and full else None
    return Assessment(answer, probability, why, loop, problems, guesses, found, amount, others, seen.answers, forces)


def _list(names: list[str]) -> str:
    return ", ".join(names) or "no method"
