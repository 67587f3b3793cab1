"""What each kind of job does, given all that the study shares; whatever is kept fits in JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from detector.evaluation import trial
from detector.evaluation.benchmark.fault_examples import Example
from detector.evaluation.benchmark.runs import Setting, healthy, simulate
from detector.evaluation.contract import BenchmarkRun
from detector.evaluation.isolation.diagnosis import feature_vectors
from detector.evaluation.jobs import START_S, Job, Study, setting
from detector.evaluation.learned import BANK
from detector.evaluation.levels import BLOCK_S, alarms
from simulator.damadics import scenario

_FEATURES = 20
"""Feature vectors that are kept of an example, at most."""


def do(study: Study, job: Job) -> Any:
    """Do a job, or take its result from the store. A job without a name is not kept."""
    kept = study.store.result(job.name) if job.name else None
    if kept is not None:
        return kept
    done = WORK[job.what](study, job)
    if job.name:
        study.store.keep(job.name, done)
    return done


def _healthy(study: Study, job: Job) -> Any:
    for rate in study.rates(job.form):
        study.fault_free(job.form, rate, job)
    return True


def _blocks(study: Study, job: Job) -> Any:
    run = job.arguments[0]
    return {
        rate: study.learned[job.form, rate].blocks(study.fault_free(job.form, rate, run), BLOCK_S)
        for rate in study.rates(job.form)
    }


def _count(study: Study, job: Job) -> Any:
    seed, seconds = job.arguments
    rates = study.rates(job.form)
    rows = healthy(seconds, setting(job.form, seed, seconds == START_S), rates)
    return {str(rate): trial.false_alarms(rows[rate], study.learned[job.form, rate]) for rate in rates}


def _scenario(study: Study, job: Job) -> Any:
    (name, seed), first = job.arguments, study.plan.seeds_from + 1
    what, rates = scenario(name), study.rates(job.form)
    rows = simulate(what.faults, study.plan.duration(job.form, what), Setting(job.form, seed), rates)
    return {
        str(rate): trial.scored(what, rows[rate], study.learned[job.form, rate], seed == first and rate == rates[0])
        for rate in rates
    }


def _example(study: Study, job: Job) -> Any:
    one: Example = job.arguments[0]
    rate = study.rates(job.form)[0]
    learned = study.learned[job.form, rate]
    run = BenchmarkRun(one.run(job.form, rate), learned.symptoms)
    alarm = alarms(learned.levels[BANK].statistic(learned.channels[BANK](run)))
    alarm[: int(one.onset_s)] = False
    rows = feature_vectors(run.signals, run.symptoms, alarm)[1]
    # Densest after the alarm, where a slow fault is weakest and a diagnosis is asked for.
    few = set(np.geomspace(1, len(rows), _FEATURES).round().astype(int).tolist()) if len(rows) else set()
    return [np.round(rows[i - 1], 4).tolist() for i in sorted(few)]


def _detectability(study: Study, job: Job) -> Any:
    name, noise_x, noise_f = job.arguments
    what = scenario(name)
    return trial.detectability(what, job.form, 1, int(study.plan.duration(job.form, what)), noise_x, noise_f)


WORK: Mapping[str, Callable[[Study, Job], Any]] = {
    "healthy": _healthy, "blocks": _blocks, "count": _count, "scenario": _scenario, "example": _example,
    "detectability": _detectability,
}  # fmt: skip
"""By what a job is."""
