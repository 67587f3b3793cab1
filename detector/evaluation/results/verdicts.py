"""Whether a detector sees a scenario, and whether the right fault is named."""

from __future__ import annotations

from math import exp
from typing import Any

from detector.evaluation.outcome import Evaluation
from detector.evaluation.performance import chance
from simulator.damadics import scenario

SURE = 0.01
"""A detection counts when a random alarm would do as well with less than this probability, and most trials have it."""


def detected(outcome: Evaluation, variant: str, name: str, detector: str) -> tuple[int, int, bool]:
    """Trials in which a detector sees a scenario, of how many, and whether that counts (`SURE`).

    Where all trials have it, a random alarm would have to be as early in all; else as frequent, up to the end.
    """
    trials = outcome.trials[variant][name]
    firsts = [trial["detectors"][detector]["first"] for trial in trials]
    hits = [first for first in firsts if first is not None]
    if not hits:
        return 0, len(trials), False
    what = scenario(name)
    faulty_s = min(what.thor, trials[0]["seconds"]) - what.faults[0].start_s
    within_s = max(hits) + 1.0 if len(hits) == len(trials) else faulty_s
    share = 1 - exp(-outcome.plan.rate_per_h * within_s / 3600)
    return len(hits), len(trials), 2 * len(hits) > len(trials) and chance(len(hits), len(trials), share) < SURE


def correctly_isolated(outcome: Evaluation, name: str, trial: dict[str, Any], when: str) -> tuple[bool, bool] | None:
    """Whether the right fault, and its group, stands first in a trial's ranking; None where there is none."""
    ranked = trial.get("diagnosis", {}).get(when) or []
    if not ranked:
        return None
    fault, first = scenario(name).faults[0].number, int(ranked[0][0])
    group = next((set(g) for g in outcome.groups if first in g), {first})
    return fault == first, fault in group
