"""The tables about which fault it is: what was named first, and which faults are taken for which."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from detector.evaluation.learned import BANK
from detector.evaluation.outcome import Evaluation
from detector.evaluation.results.table import ResultTable, number
from detector.evaluation.results.verdicts import correctly_isolated, detected
from simulator.damadics import FAULTS, scenario


def isolation_table(outcome: Evaluation) -> ResultTable:
    """A row for each trial that was diagnosed."""
    rows = []
    for name, trials in outcome.trials[outcome.plan.variants[0]].items():
        for seed, trial in enumerate(trials, 1):
            if (early := correctly_isolated(outcome, name, trial, "ranked")) is None:
                continue
            one, late = trial["diagnosis"], correctly_isolated(outcome, name, trial, "last") or (False, False)
            places = [f"f{int(fault)} ({apart:.2f})" for fault, apart in one["ranked"][:3]]
            i = one["isolation"]
            rows.append((
                name, str(seed), " ".join(places), _yes(early[0]), _yes(early[1]), _yes(late[1]), number(i["tdt"]),
                f"{i['rfd']:.3f}", f"{i['rtd']:.3f}", number(i["fsd"]), f"{one['rmi']:.3f}", f"{one['dacc']:.2f}",
            ))  # fmt: skip
    words, groups = isolation_words(outcome), _group_words(outcome.groups)
    note = f"Ranked five minutes after the alarm, with distances; {words} Groups: {groups}."
    heads = (
        "scenario",
        "seed",
        "ranked first",
        "fault",
        "group",
        "group at end",
        "tit [s]",
        "rfi",
        "rti",
        "fsi",
        "rmi",
        "dacc",
    )
    return ResultTable("isolation", "Which fault it is", note, heads, tuple(rows))


def isolation_words(outcome: Evaluation) -> str:
    """How often the right fault or group stands first, over scenarios (most trials) and over trials."""
    variant, scores = outcome.plan.variants[0], []
    for name, trials in outcome.trials[variant].items():
        found = [one for trial in trials if (one := correctly_isolated(outcome, name, trial, "ranked")) is not None]
        if found and (BANK not in outcome.plan.detectors or detected(outcome, variant, name, BANK)[2]):
            scores.append(np.mean(found, axis=0))
    if not scores:
        return "no scenario was diagnosed."
    most = np.array(scores) > 0.5
    return (
        f"right fault first in {most[:, 0].sum()}, right fault or group in {most[:, 1].sum()} of {len(most)} detected "
        "scenarios (most trials)."
    )


def _group_words(groups: Sequence[Sequence[int]]) -> str:
    return ", ".join("{" + " ".join(f"f{fault}" for fault in sorted(group)) + "}" for group in groups if len(group) > 1)


def confusion_table(outcome: Evaluation) -> ResultTable:
    """True faults against those named first."""
    counts = np.zeros((len(FAULTS) + 1, len(FAULTS) + 1), int)
    for name, trials in outcome.trials[outcome.plan.variants[0]].items():
        for trial in trials:
            ranked = trial.get("diagnosis", {}).get("ranked") or []
            counts[scenario(name).faults[0].number, int(ranked[0][0]) if ranked else 0] += 1
    rows = [
        (f"f{fault}", *(str(n) if n else "" for n in counts[fault, 1:]), str(counts[fault, 0] or ""))
        for fault in FAULTS if counts[fault].any()
    ]  # fmt: skip
    heads = ("true", *(f"f{fault}" for fault in FAULTS), "none")
    note = "Trials by true fault (rows) and the fault named first five minutes after the alarm (columns)."
    return ResultTable("confusion", "Confusion matrix", note, heads, tuple(rows))


def _yes(value: bool) -> str:
    return "yes" if value else "no"
