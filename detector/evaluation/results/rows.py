"""The tables of an evaluation: rows of text under headings, the same for CSV, Markdown and the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from detector.evaluation.benchmark.published import OTHERS, R2
from detector.evaluation.isolation.structure import groups as structural_groups
from detector.evaluation.jobs import SEEDS
from detector.evaluation.outcome import Evaluation
from detector.evaluation.plan import Plan
from detector.evaluation.results.isolation_rows import confusion_table, isolation_table
from detector.evaluation.results.table import ResultTable, number
from detector.evaluation.results.verdicts import detected
from simulator.damadics import Form, scenario


def tables(outcome: Evaluation) -> list[ResultTable]:
    """All tables, in the order of the page."""
    made = [_summary(outcome), _scenarios(outcome)]
    if outcome.groups:
        made += [isolation_table(outcome), confusion_table(outcome)]
    return [*made, _unseen(outcome), _structure(), _published(), _trials(outcome)]


def _summary(outcome: Evaluation) -> ResultTable:
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
                variant, detector, f"{len(sure)} of {len(scenarios)}", number(np.median(firsts) if firsts else None),
                f"{np.mean([one['rtd'] for one in every]):.3f}", f"{np.mean([one['rfd'] for one in every]):.4f}",
                f"{false} in {hours:.1f} h", f"{false / hours:.4f}",
            ))  # fmt: skip
    note = (
        f"Stated rate of false alarms: {outcome.plan.rate_per_h:g} an hour. Detected: in most trials, and better than "
        f"the random alarm at 99 %. Median time of the abrupt ones from onset to first alarm; rtd and rfd: share of "
        f"the faulty and of the fault-free time with an alarm. {_trial_words(outcome)}"
    )
    heads = ("variant", "detector", "detected", "median time [s]", "mean rtd", "mean rfd", "false alarms", "per hour")
    return ResultTable("summary", "All detectors at one rate of false alarms", note, heads, tuple(rows))


def _trial_words(outcome: Evaluation) -> str:
    plan = outcome.plan
    learn, calibrate, judge, starts, judged_starts = (first + plan.seeds_from for first in SEEDS.values())
    return (
        f"Trials: {' '.join(_form_words(plan, form) for form in plan.forms)} Seeds of scenarios from "
        f"{plan.seeds_from + 1}, of fault-free runs from {learn}, {calibrate}, {judge}; {plan.starts[0]} and "
        f"{plan.starts[1]} starts of 25 min to calibrate and judge, from {starts}, {judged_starts}; "
        "examples of faults from 50000."
    )


def _form_words(plan: Plan, form: Form) -> str:
    """Trials and fault-free hours of a form."""
    usual, long = (plan.seeds, plan.long_seeds) if form == "play" else plan.other_seeds
    followed_h = plan.long_h if form == "play" else plan.other_long_h
    cut = f", followed for {followed_h:g} h" if followed_h < 24.0 else ""
    hours = _hours(plan.hours(form))
    return (
        f"{form}: {usual} of each scenario ({long} of the day-long ones{cut}), {hours} fault-free to learn, calibrate "
        "and judge."
    )


def _hours(hours: Sequence[float]) -> str:
    return " + ".join(f"{one:g}" for one in hours) + " h"


def _scenarios(outcome: Evaluation) -> ResultTable:
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
    return ResultTable("scenarios", "When each detector sees each fault", note, heads, tuple(rows))


def _short_words(outcome: Evaluation) -> str:
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


def _cell(outcome: Evaluation, variant: str, name: str, detector: str) -> str:
    hits, count, _ = detected(outcome, variant, name, detector)
    if not hits:
        return "-"
    firsts = [trial["detectors"][detector]["first"] for trial in outcome.trials[variant][name]]
    middle = number(np.median([one for one in firsts if one is not None]))
    return middle if hits == count else f"{middle} ({hits}/{count})"


def _unseen(outcome: Evaluation) -> ResultTable:
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
    return ResultTable("unseen", "What is missed, and how much of it there is to see", note, heads, tuple(rows))


def _structure() -> ResultTable:
    rows = tuple((", ".join(f"f{fault}" for fault in group),) for group in structural_groups())
    note = "Faults that violate the same relations between basic signals; only size and shape can tell them apart."
    return ResultTable("structure", "What structure alone can tell apart", note, ("group",), rows)


def plant_table(counts: Mapping[str, int | str], rate_per_h: float, hours: float) -> ResultTable:
    """Alarms on measured data by detector."""
    rows = tuple((name, str(count)) for name, count in counts.items())
    note = (
        f"Learned and calibrated on the first third of the record, {rate_per_h:g} an hour stated; alarms in the "
        f"{hours:.2f} h after it, in which no fault is documented."
    )
    return ResultTable("plant", "Measured data of a plant", note, ("detector", "alarms"), rows)


def _published() -> ResultTable:
    note = "Results of others on the benchmark; methods, data and noise differ."
    return ResultTable("published", "Published results", note, ("id", "method", "data", "result"), OTHERS)


def _trials(outcome: Evaluation) -> ResultTable:
    """Every index of every trial."""
    rows = []
    for variant, scenarios in outcome.trials.items():
        for name, trials in scenarios.items():
            for seed, trial in enumerate(trials, 1):
                for detector in outcome.plan.detectors:
                    one = trial["detectors"][detector]
                    rows.append((
                        variant, name, str(seed), detector, number(one["first"]), number(one["tdt"]),
                        f"{one['rfd']:.4f}", f"{one['rtd']:.4f}", number(one["fs_first"]), number(one["fsd"]),
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
    return ResultTable("trials", "All indices of all trials", note, heads, tuple(rows))
