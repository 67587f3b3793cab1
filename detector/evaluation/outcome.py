"""What an evaluation measured, gathered from the store."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from detector.evaluation.jobs import Job, Study, scored_jobs
from detector.evaluation.learned import BANK
from detector.evaluation.plan import Plan
from recordings import BadInput
from simulator.damadics import scenario

Trials = dict[str, dict[str, list[dict[str, Any]]]]
"""By variant and scenario, what `detector.evaluation.trial.scored` says of each trial."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Everything measured. texts : what each detector is, by name; trials : see `Trials`; healthy : by variant and
    detector, false alarms; hours : fault-free hours judged, by variant; groups : faults named together; signatures :
    mean features by fault; detectability : how much a missed scenario moves X and F, by scenario.
    """

    plan: Plan
    texts: Mapping[str, str]
    trials: Trials
    healthy: dict[str, dict[str, int]]
    hours: dict[str, float]
    groups: list[list[int]]
    signatures: dict[int, list[float]]
    detectability: dict[str, dict[str, float]] = field(default_factory=dict)


def gathered(study: Study) -> Evaluation:
    """All results of a study but the detectability. Raises BadInput when one is gone."""
    plan = study.plan
    trials: Trials = {variant: {} for variant in plan.variants}
    false: dict[str, dict[str, int]] = {variant: dict.fromkeys(plan.detectors, 0) for variant in plan.variants}
    hours = dict.fromkeys(plan.variants, 0.0)
    for form, rates in plan.forms.items():
        for job in scored_jobs(plan, form):
            result = study.store.result(job.name)
            if result is None:
                raise BadInput(job.name, "its result is gone", "run the evaluation again")
            for rate in rates:
                _add(f"{form}-{rate}", job, result[str(rate)], trials, false, hours)
    groups, matrix = _signatures(study)
    texts = {name: study.detectors[name].text for name in plan.detectors}
    return Evaluation(plan, texts, trials, false, hours, groups, matrix)


def missed(outcome: Evaluation) -> list[str]:
    """The scenarios that some trial of the bank misses, in the first variant; without the bank, that some trial of all
    detectors misses.
    """
    judges = [BANK] if BANK in outcome.plan.detectors else list(outcome.plan.detectors)
    return [
        name
        for name, trials in outcome.trials[outcome.plan.variants[0]].items()
        if any(all(trial["detectors"][judge]["first"] is None for judge in judges) for trial in trials)
    ]


def _signatures(study: Study) -> tuple[list[list[int]], dict[int, list[float]]]:
    """Groups of faults, and the signature of each fault, of the first form that has them."""
    forms = study.plan.forms
    signs = next((s for form in forms if (s := study.store.result(f"signatures-{form}")) is not None), None)
    groups: dict[int, list[int]] = {}
    for fault, number in (signs or {"group": {}})["group"].items():
        groups.setdefault(number, []).append(int(fault))
    return list(groups.values()), {int(fault): row for fault, row in (signs or {"matrix": {}})["matrix"].items()}


def _add(
    variant: str, job: Job, result: Any, trials: Trials,
    false: dict[str, dict[str, int]], hours: dict[str, float],
) -> None:  # fmt: skip
    """One result to where it belongs; the fault-free part of a scenario counts as fault-free hours."""
    if job.what == "count":
        hours[variant] += (job.arguments[1] - 300) / 3600
        for name, number in result.items():
            false[variant][name] += number
        return
    what = scenario(job.arguments[0])
    hours[variant] += (what.faults[0].start_s - what.ton) / 3600
    for name, one in result["detectors"].items():
        false[variant][name] += one["false"]
    trials[variant].setdefault(what.name, []).append(result)
