"""A whole evaluation: learn, calibrate, judge; on all cores, with progress, resumed after an interruption."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from detector.evaluation.benchmark.fault_examples import examples
from detector.evaluation.contract import Detector
from detector.evaluation.detectors import DETECTORS
from detector.evaluation.isolation.diagnosis import learn_diagnosis
from detector.evaluation.jobs import Job, Study, fault_free_jobs, key, scored_jobs
from detector.evaluation.learned import BANK, Learned, learn
from detector.evaluation.levels import BLOCK_S, Levels, calibrate
from detector.evaluation.outcome import Evaluation, gathered, missed
from detector.evaluation.plan import Plan, check_names
from detector.evaluation.processes import in_processes
from detector.evaluation.store import Store
from detector.evaluation.work import do
from recordings import Array, Progress, silent
from simulator.damadics import Form

SAFETY = 2.0
"""Levels are estimates from some days: they are set for the stated rate over this."""

NOISE_X, NOISE_F = 2.5e-3, 3e-3
"""Deviation of the residuals of X and F without a fault [shares of their spans]."""

RunJobs = Callable[[Study, Sequence[Job], str], list[Any]]
"""Does jobs of a study, a stage of that name, and gives their results in order."""


def evaluate(
    plan: Plan,
    out: Path,
    progress: Progress = silent,
    workers: int | None = None,
    *,
    detectors: Mapping[str, Detector] | None = None,
) -> Evaluation:
    """Run a plan; results are kept in ``out/work`` and resumed.

    Parameters
    ----------
    plan : Plan
        Which of the detectors, on which scenarios, how often.
    out : Path
        Folder for results. Raises BadInput when it cannot be written.
    progress : Progress, optional
        Told of every stage.
    workers : int, optional
        Processes; all cores where not given.
    detectors : mapping of str to Detector, optional
        Detectors of your own by name; they are compared besides those that the plan names. What they have learned is
        kept under their name and text: change the text, or the folder, when you change the detector.

    Raises BadParameter for a detector that nobody knows. KeyboardInterrupt leaves what is finished.
    """
    known = {**DETECTORS, **(detectors or {})}
    check_names("detectors", plan.detectors, tuple(known))
    plan = replace(plan, detectors=tuple(dict.fromkeys((*plan.detectors, *(detectors or {})))))
    study = Study(plan, known, Store.at(out, key(plan, {name: known[name] for name in plan.detectors})))
    count = workers or os.cpu_count() or 1

    def run(study: Study, jobs: Sequence[Job], stage: str) -> list[Any]:
        return in_processes(partial(do, study), jobs, count, progress, stage)

    for form in plan.forms:
        study = _evaluated(study, form, run)
    outcome = gathered(study)
    return replace(outcome, detectability=_detectability(study, missed(outcome), run))


def _evaluated(study: Study, form: Form, run: RunJobs) -> Study:
    """All results of a form in the store; the study with what was learned for it."""
    purposes = ("learn", "calibrate", "calibrate-start")
    made = [job for purpose in purposes for job in fault_free_jobs(study.plan, form, purpose)]
    run(study, made, f"{form}: fault-free runs")
    pending = study.pending(scored_jobs(study.plan, form))
    if pending:
        study = _learned(study, form, run)
        run(study, pending, f"{form}: scenarios")
    return study


def _learned(study: Study, form: Form, run: RunJobs) -> Study:
    """The study with what the detectors learn for a form: relations and detectors, then levels, then signatures."""
    plan = study.plan
    for rate in study.rates(form):
        runs = [study.fault_free(form, rate, job) for job in fault_free_jobs(plan, form, "learn")]
        chosen = {name: study.detectors[name] for name in plan.detectors}
        study = _with(study, form, rate, learn([runs[0], *runs], chosen))
    long, short = (fault_free_jobs(plan, form, purpose) for purpose in ("calibrate", "calibrate-start"))
    every = [replace(job, name="", what="blocks", arguments=(job,)) for job in (*long, *short)]
    found = run(study, every, f"{form}: calibration")
    for rate in study.rates(form):
        levels = {name: _levels(plan, [one[rate][name] for one in found], len(long)) for name in plan.detectors}
        study = _with(study, form, rate, replace(study.learned[form, rate], levels=levels))
    if plan.examples and BANK in plan.detectors and form == next(iter(plan.forms)):
        study = _with_signatures(study, form, run)
    return study


def _with(study: Study, form: Form, rate: int, learned: Learned) -> Study:
    return replace(study, learned={**study.learned, (form, rate): learned})


def _levels(plan: Plan, found: Sequence[Array], long: int) -> Levels:
    """Levels from blocks (n_blocks, n_channels) of the long runs, the first `long`, and of the short ones after them:
    both kinds of start, each block after it by itself.
    """
    kinds = [np.stack(found[long + kind :: 2]) for kind in (0, 1) if len(found) > long + kind]
    starts = [kind[:, place] for kind in kinds for place in range(kind.shape[1])]
    return calibrate(np.vstack(found[:long]), plan.rate_per_h / SAFETY, BLOCK_S, starts)


def _with_signatures(study: Study, form: Form, run: RunJobs) -> Study:
    """The study with the signatures of the first rate of a form; the others are learned at that rate, too."""
    rate = study.rates(form)[0]
    every = [Job(f"example-{form}-{one.seed}", "example", form, (one,)) for one in examples(study.plan.examples)]
    rows = run(study, every, f"{form}: signatures")
    known = learn_diagnosis(
        [(job.arguments[0].number, job.name, np.array(row)) for job, row in zip(every, rows, strict=True)]
    )
    study.store.keep(
        f"signatures-{form}", {"group": known.group, "matrix": {f: row.tolist() for f, row in known.matrix().items()}}
    )
    return _with(study, form, rate, replace(study.learned[form, rate], diagnosis=known))


def _detectability(study: Study, scenarios: Sequence[str], run: RunJobs) -> dict[str, dict[str, float]]:
    """How much scenarios move X and F, in the first form of friction."""
    form: Form = next(iter(study.plan.forms))
    every = [Job(f"footprint-{form}-{name}", "detectability", form, (name, NOISE_X, NOISE_F)) for name in scenarios]
    return dict(zip(scenarios, run(study, every, "what was missed"), strict=True))
