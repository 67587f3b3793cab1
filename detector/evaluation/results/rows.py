"""The tables of an evaluation: rows of text under headings, the same for CSV, Markdown and the page."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp
from typing import Any

import numpy as np

from detector.evaluation.benchmark.published import OTHERS, R2
from detector.evaluation.isolation.structure import groups as structural_groups
from detector.evaluation.learned import BANK
from detector.evaluation.outcome import Outcome
from detector.evaluation.performance import chance
from detector.evaluation.plan import Plan
from simulator.damadics import FAULTS, Form, scenario

SURE = 0.01
"""A detection counts when a random alarm would do as well with less than this probability, and most trials have it."""


@dataclass(frozen=True)
class Table:
    """name : of its file; title; note : how to read it; heads and rows : text."""

    name: str
    title: str
    note: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def csv(self) -> str:
        """As comma-separated values."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerows([self.heads, *self.rows])
        return text.getvalue()

    def markdown(self) -> str:
        """As a section of a Markdown page."""
        lines = ["| " + " | ".join(row) + " |" for row in (self.heads, ("---",) * len(self.heads), *self.rows)]
        return "\n".join([f"## {self.title}", "", self.note, "", *lines, ""])


def tables(outcome: Outcome) -> list[Table]:
    """All tables, in the order of the page."""
    made = [_summary(outcome), _scenarios(outcome)]
    if outcome.groups:
        made += [_isolation(outcome), _confusion(outcome)]
    return [*made, _unseen(outcome), _structure(), _published(), _trials(outcome)]


def detected(outcome: Outcome, variant: str, name: str, detector: str) -> tuple[int, int, bool]:
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


def correctly_isolated(outcome: Outcome, name: str, trial: dict[str, Any], when: str) -> tuple[bool, bool] | None:
    """Whether the right fault, and its group, stands first in a trial's ranking; None where there is none."""
    ranked = trial.get("diagnosis", {}).get(when) or []
    if not ranked:
        return None
    fault, first = scenario(name).faults[0].number, int(ranked[0][0])
    group = next((set(g) for g in outcome.groups if first in g), {first})
    return fault == first, fault in group


def _summary(outcome: Outcome) -> Table:
    rows = []
    for variant, scenarios in outcome.trials.items():
        for detector in outcome.plan.detectors:
            sure = [name for name in scenarios if detected(outcome, variant, name, detector)[2]]
            firsts = [
                trial["detectors"][detector]["first"]
                for name in sure if "abrupt" in name for trial in scenarios[name]
                if trial["detectors"][detector]["first"] is not None
            ]  # fmt: skip
            every = [trial["detectors"][detector] for trials in scenarios.values() for trial in trials]
            false, hours = outcome.healthy[variant][detector], outcome.hours[variant]
            rows.append((
                variant, detector, f"{len(sure)} of {len(scenarios)}", _number(np.median(firsts) if firsts else None),
                f"{np.mean([one['rtd'] for one in every]):.3f}", f"{np.mean([one['rfd'] for one in every]):.4f}",
                f"{false} in {hours:.1f} h", f"{false / hours:.4f}",
            ))  # fmt: skip
    note = (
        f"Stated rate of false alarms: {outcome.plan.rate_per_h:g} an hour. Detected: in most trials, and better than "
        f"the random alarm at 99 %. Median time of the abrupt ones from onset to first alarm; rtd and rfd: share of "
        f"the faulty and of the fault-free time with an alarm. {_trial_words(outcome)}"
    )
    heads = ("variant", "detector", "detected", "median time [s]", "mean rtd", "mean rfd", "false alarms", "per hour")
    return Table("summary", "All detectors at one rate of false alarms", note, heads, tuple(rows))


def _trial_words(outcome: Outcome) -> str:
    plan = outcome.plan
    return (
        f"Trials: {' '.join(_form_words(plan, form) for form in plan.forms)} Seeds of fault-free runs from 1000, 2000, "
        f"3000; {plan.starts[0]} and {plan.starts[1]} starts of 25 min to calibrate and judge, from 4000, 5000; "
        "examples of faults from 50000."
    )


def _form_words(plan: Plan, form: Form) -> str:
    """Trials and fault-free hours of a form."""
    usual, long = (plan.seeds, plan.long_seeds) if form == "play" else plan.other_seeds
    cut = "" if form == "play" else f", followed for {plan.other_long_h:g} h"
    hours = _hours(plan.hours(form))
    return (
        f"{form}: {usual} of each scenario ({long} of the day-long ones{cut}), {hours} fault-free to learn, calibrate "
        "and judge."
    )


def _hours(hours: Sequence[float]) -> str:
    return " + ".join(f"{one:g}" for one in hours) + " h"


def _scenarios(outcome: Outcome) -> Table:
    """A row per scenario and variant: time of the first alarm, median over the trials, by detector."""
    rows = []
    for variant, scenarios in outcome.trials.items():
        for name, trials in scenarios.items():
            cells = [_cell(outcome, variant, name, detector) for detector in outcome.plan.detectors]
            rows.append((variant, name, str(len(trials)), *cells, R2.get(name, "")))
    note = (
        "Median time from onset to first alarm [s]; in brackets the trials that saw it, if not all; - where none. "
        f"R2: published, dynamic GMDH.{_short_words(outcome)}"
    )
    heads = ("variant", "scenario", "trials", *outcome.plan.detectors, "R2")
    return Table("scenarios", "When each detector sees each fault", note, heads, tuple(rows))


def _short_words(outcome: Outcome) -> str:
    """Which runs ended before their time, in words."""
    ended = []
    for variant, scenarios in outcome.trials.items():
        form = next(form for form in outcome.plan.forms if variant.startswith(f"{form}-"))
        for name, trials in scenarios.items():
            least, planned = min(trial["seconds"] for trial in trials), int(outcome.plan.duration(form, scenario(name)))
            if least < planned:
                ended.append(
                    f" {name} in {variant}: the simulation stops being finite, judged to {least} of {planned} s."
                )
    return "".join(ended)


def _cell(outcome: Outcome, variant: str, name: str, detector: str) -> str:
    hits, count, _ = detected(outcome, variant, name, detector)
    if not hits:
        return "-"
    firsts = [trial["detectors"][detector]["first"] for trial in outcome.trials[variant][name]]
    middle = _number(np.median([one for one in firsts if one is not None]))
    return middle if hits == count else f"{middle} ({hits}/{count})"


def _isolation(outcome: Outcome) -> Table:
    rows = []
    for name, trials in outcome.trials[outcome.plan.variants[0]].items():
        for seed, trial in enumerate(trials, 1):
            if (early := correctly_isolated(outcome, name, trial, "ranked")) is None:
                continue
            one, late = trial["diagnosis"], correctly_isolated(outcome, name, trial, "last") or (False, False)
            places = [f"f{int(fault)} ({apart:.2f})" for fault, apart in one["ranked"][:3]]
            i = one["isolation"]
            rows.append((
                name, str(seed), " ".join(places), _yes(early[0]), _yes(early[1]), _yes(late[1]), _number(i["tdt"]),
                f"{i['rfd']:.3f}", f"{i['rtd']:.3f}", _number(i["fsd"]), f"{one['rmi']:.3f}", f"{one['dacc']:.2f}",
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
    return Table("isolation", "Which fault it is", note, heads, tuple(rows))


def isolation_words(outcome: Outcome) -> str:
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


def _confusion(outcome: Outcome) -> Table:
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
    return Table("confusion", "Confusion matrix", note, heads, tuple(rows))


def _unseen(outcome: Outcome) -> Table:
    rows = []
    for name, found in outcome.detectability.items():
        reason = "no basic signal is touched" if found["all"] < 1e-9 else "its trace drowns in the noise"
        if found["all"] > 8:
            reason = "would show to a matched filter, weak for what is known beforehand"
        rows.append((name, f"{found['x']:.4f}", f"{found['f']:.4f}", f"{found['all']:.2f}", reason))
    note = (
        "Scenarios that some trial misses. Effect on X and on F: rms of the run less its fault-free twin over the "
        "deviation of the residual (0.25 % of stroke, 0.3 % of span); and the ratio of a filter matched to all of it."
    )
    heads = ("scenario", "X", "F", "matched filter", "reason")
    return Table("unseen", "What is missed, and how much of it there is to see", note, heads, tuple(rows))


def _structure() -> Table:
    rows = tuple((", ".join(f"f{fault}" for fault in group),) for group in structural_groups())
    note = "Faults that violate the same relations between basic signals; only size and shape can tell them apart."
    return Table("structure", "What structure alone can tell apart", note, ("group",), rows)


def plant_table(counts: Mapping[str, int | str], rate_per_h: float, hours: float) -> Table:
    """Alarms on measured data by detector."""
    rows = tuple((name, str(count)) for name, count in counts.items())
    note = (
        f"Learned and calibrated on the first third of the record, {rate_per_h:g} an hour stated; alarms in the "
        f"{hours:.2f} h after it, in which no fault is documented."
    )
    return Table("plant", "Measured data of a plant", note, ("detector", "alarms"), rows)


def _published() -> Table:
    note = "Results of others on the benchmark; methods, data and noise differ."
    return Table("published", "Published results", note, ("id", "method", "data", "result"), OTHERS)


def _trials(outcome: Outcome) -> Table:
    """Every index of every trial."""
    rows = []
    for variant, scenarios in outcome.trials.items():
        for name, trials in scenarios.items():
            for seed, trial in enumerate(trials, 1):
                for detector in outcome.plan.detectors:
                    one = trial["detectors"][detector]
                    rows.append((
                        variant, name, str(seed), detector, _number(one["first"]), _number(one["tdt"]),
                        f"{one['rfd']:.4f}", f"{one['rtd']:.4f}", _number(one["fs_first"]), _number(one["fsd"]),
                    ))  # fmt: skip
    heads = (
        "variant",
        "scenario",
        "seed",
        "detector",
        "first [s]",
        "tdt [s]",
        "rfd",
        "rtd",
        "strength at first",
        "fsd",
    )
    note = "Times from onset to the first and (tdt) to the last rising edge; shares of fault-free and faulty time."
    return Table("trials", "All indices of all trials", note, heads, tuple(rows))


def _number(value: Any) -> str:
    if value is None:
        return "-"
    return f"{float(value):.0f}" if abs(float(value)) >= 1000 else f"{float(value):.4g}"


def _yes(value: bool) -> str:
    return "yes" if value else "no"
