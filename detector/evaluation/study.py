"""A whole evaluation: learn, calibrate, judge; on all cores, with progress, taken up again after an interruption."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np

from detector.alarms.levels import BLOCK_S, Levels, alarms, calibrate
from detector.evaluation import jobs
from detector.evaluation.benchmark.fault_examples import Example, examples
from detector.evaluation.benchmark.runs import Setting, elsewhere, healthy, simulate
from detector.evaluation.detectors import Seen
from detector.evaluation.isolation.diagnosis import learn_diagnosis, portrait
from detector.evaluation.learned import BANK, SETTLE_S, Learned, learn
from detector.evaluation.plan import Plan
from detector.evaluation.store import Store
from recordings import Array, BadInput
from simulator.damadics import Form, scenario

Progress = Callable[[str, int, int], None]
"""Told what is going on, how many pieces of it are done, and of how many."""

SEEDS = {"learn": 1000, "calibrate": 2000, "judge": 3000, "calibrate-start": 4000, "judge-start": 5000}
"""Seeds of the fault-free runs for each purpose begin here; scenarios take 1, 2, 3, ..."""

START_S = SETTLE_S + 2 * BLOCK_S
"""Length of the short runs [s]: what the benchmark's abrupt scenarios have."""

SAFETY = 2.0
"""Levels are estimates from some days: they are set for the stated rate over this."""

_DAY_S = 86_400
_PORTRAITS = 20


@dataclass(frozen=True)
class Job:
    """One piece of work. name : of its file; what : of `_WORK`; form and arguments of it."""

    name: str
    what: str
    form: Form
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True, eq=False)
class Outcome:
    """Everything measured. judged : by variant and scenario, a list of trials; healthy : by variant and detector, false
    alarms; hours : fault-free hours judged, by variant; groups : faults named together; footprints : by scenario.
    """

    plan: Plan
    judged: dict[str, dict[str, list[dict[str, Any]]]]
    healthy: dict[str, dict[str, int]]
    hours: dict[str, float]
    groups: list[list[int]]
    signatures: dict[int, list[float]]
    footprints: dict[str, dict[str, float]]


_LEARNED: dict[tuple[Form, int], Learned] = {}
"""By form and rate; filled before workers are forked, which inherit it: nothing learned is sent between processes."""
_PLAN: list[Plan] = []
_STORES: list[Store] = []


def evaluate(plan: Plan, out: Path, progress: Progress = lambda *_: None, workers: int | None = None) -> Outcome:
    """Run a plan; results are kept in ``out/work`` and taken up again. workers : processes, all cores where not given.

    Raises BadInput when `out` cannot be written. KeyboardInterrupt leaves what is finished.
    """
    count = workers or os.cpu_count() or 1
    _PLAN[:], _STORES[:] = [plan], [Store.at(out, plan.key)]
    _LEARNED.clear()
    for form in plan.forms:
        purposes = ("learn", "calibrate", "calibrate-start")
        _all([job for purpose in purposes for job in _healthy_jobs(plan, form, purpose)], count, progress,
             f"{form}: fault-free runs")  # fmt: skip
        pending = _pending(_judging(plan, form))
        if pending:
            _learn(plan, form, count, progress)
            _all(pending, count, progress, f"{form}: scenarios")
    return _gathered(plan, count, progress)


def _learn(plan: Plan, form: Form, count: int, progress: Progress) -> None:
    """Fill `_LEARNED` for a form: relations and detectors, then levels, then signatures."""
    for rate in plan.forms[form]:
        runs = [_kept(plan, form, rate, job) for job in _healthy_jobs(plan, form, "learn")]
        _LEARNED[form, rate] = learn([runs[0], *runs], plan.detectors)
    long, short = (_healthy_jobs(plan, form, purpose) for purpose in ("calibrate", "calibrate-start"))
    every = [replace(job, name="", what="blocks", arguments=(job,)) for job in (*long, *short)]
    found = _all(every, count, progress, f"{form}: calibration")
    for rate in plan.forms[form]:
        levels = {name: _levels(plan, [one[rate][name] for one in found], len(long)) for name in plan.detectors}
        _LEARNED[form, rate] = replace(_LEARNED[form, rate], levels=levels)
    if plan.examples and BANK in plan.detectors and form == next(iter(plan.forms)):
        _learn_signatures(plan, form, count, progress)


def _levels(plan: Plan, found: Sequence[Array], long: int) -> Levels:
    """Levels from blocks (n_blocks, n_channels) of the long runs, the first `long`, and of the short ones after them:
    both kinds of start, each block after it by itself.
    """
    kinds = [np.stack(found[long + kind :: 2]) for kind in (0, 1) if len(found) > long + kind]
    starts = [kind[:, place] for kind in kinds for place in range(kind.shape[1])]
    return calibrate(np.vstack(found[:long]), plan.rate_per_h / SAFETY, BLOCK_S, starts)


def _learn_signatures(plan: Plan, form: Form, count: int, progress: Progress) -> None:
    """Signatures of the first rate of a form; the others are learned at that rate, too."""
    rate = plan.forms[form][0]
    every = [Job(f"example-{form}-{one.seed}", "example", form, (one,)) for one in examples(plan.examples)]
    rows = _all(every, count, progress, f"{form}: signatures")
    known = learn_diagnosis(
        [(job.arguments[0].number, job.name, np.array(row)) for job, row in zip(every, rows, strict=True)]
    )
    _LEARNED[form, rate] = replace(_LEARNED[form, rate], diagnosis=known)
    _STORES[0].keep(
        f"signatures-{form}", {"group": known.group, "matrix": {f: row.tolist() for f, row in known.matrix().items()}}
    )


def _healthy_jobs(plan: Plan, form: Form, purpose: str) -> list[Job]:
    """Fault-free runs for a purpose of `SEEDS`: of a day at most each, or short ones from a start."""
    seeds = range(SEEDS[purpose], SEEDS[purpose] + 1000)
    if purpose.endswith("start"):
        lengths = [START_S] * plan.starts[("calibrate-start", "judge-start").index(purpose)]
    else:
        seconds = round(plan.hours(form)[("learn", "calibrate", "judge").index(purpose)] * 3600)
        lengths = [min(_DAY_S, seconds - begun) for begun in range(0, seconds, _DAY_S)]
    what = "count" if purpose.startswith("judge") else "healthy"
    return [
        Job(f"{purpose}-{form}-{_rates(plan, form)}-{seed}", what, form, (seed, seconds))
        for seed, seconds in zip(seeds, lengths, strict=False)
    ]


def _setting(form: Form, seed: int) -> Setting:
    """How a fault-free run is made; every second of the short ones does not start as the benchmark does."""
    return elsewhere(form, seed) if seed >= SEEDS["calibrate-start"] and seed % 2 else Setting(form, seed)


def _rates(plan: Plan, form: Form) -> str:
    """The sampling rates of a form, for names: results at other rates are others."""
    return "-".join(str(rate) for rate in plan.forms[form])


def _judging(plan: Plan, form: Form) -> list[Job]:
    """Scenarios, the long ones first so that no core waits at the end, and fault-free hours to judge."""
    made = [
        Job(f"{name}-{form}-{_rates(plan, form)}-{seed}", "scenario", form, (name, seed))
        for name in plan.scenarios
        for seed in range(1, plan.trials(form, scenario(name)) + 1)
    ]
    made.sort(key=lambda job: -plan.duration(form, scenario(job.arguments[0])))
    return _healthy_jobs(plan, form, "judge") + made + _healthy_jobs(plan, form, "judge-start")


def _pending(every: Sequence[Job]) -> list[Job]:
    return [job for job in every if _STORES[0].result(job.name) is None]


def _kept(plan: Plan, form: Form, rate: int, job: Job) -> Array:
    """A fault-free run at a rate; made when it is not there."""
    seed, seconds = job.arguments

    def make() -> Array:
        rows = healthy(seconds, _setting(form, seed), plan.forms[form])
        return np.stack([rows[one] for one in plan.forms[form]])

    return _STORES[0].run(f"{job.name}-{seconds}", make)[plan.forms[form].index(rate)]


def _healthy(job: Job) -> Any:
    for rate in _PLAN[0].forms[job.form]:
        _kept(_PLAN[0], job.form, rate, job)
    return True


def _blocks(job: Job) -> Any:
    plan, run = _PLAN[0], job.arguments[0]
    rates = plan.forms[job.form]
    return {rate: _LEARNED[job.form, rate].blocks(_kept(plan, job.form, rate, run), BLOCK_S) for rate in rates}


def _count(job: Job) -> Any:
    seed, seconds = job.arguments
    rates = _PLAN[0].forms[job.form]
    rows = healthy(seconds, _setting(job.form, seed), rates)
    return {str(rate): jobs.healthy_alarms(rows[rate], _LEARNED[job.form, rate]) for rate in rates}


def _scenario(job: Job) -> Any:
    name, seed = job.arguments
    what, rates = scenario(name), _PLAN[0].forms[job.form]
    rows = simulate(what.faults, _PLAN[0].duration(job.form, what), Setting(job.form, seed), rates)
    return {str(rate): jobs.judge(what, rows[rate], _LEARNED[job.form, rate], seed == 1 and rate == rates[0])
            for rate in rates}  # fmt: skip


def _example(job: Job) -> Any:
    one: Example = job.arguments[0]
    rate = _PLAN[0].forms[job.form][0]
    learned = _LEARNED[job.form, rate]
    seen = Seen(one.run(job.form, rate), learned.symptoms)
    alarm = alarms(learned.levels[BANK].statistic(learned.channels[BANK](seen)))
    alarm[: int(one.onset_s)] = False
    rows = portrait(seen.run, seen.symptoms, alarm)[1]
    # Densest after the alarm, where a slow fault is weakest and a diagnosis is asked for.
    few = set(np.geomspace(1, len(rows), _PORTRAITS).round().astype(int).tolist()) if len(rows) else set()
    return [np.round(rows[i - 1], 4).tolist() for i in sorted(few)]


def _footprint(job: Job) -> Any:
    name, noise_x, noise_f = job.arguments
    what = scenario(name)
    return jobs.footprint(what, job.form, 1, int(_PLAN[0].duration(job.form, what)), noise_x, noise_f)


_WORK: dict[str, Callable[[Job], Any]] = {
    "healthy": _healthy, "blocks": _blocks, "count": _count, "scenario": _scenario, "example": _example,
    "footprint": _footprint,
}  # fmt: skip


def _do(job: Job) -> Any:
    """Do a job, or take its result from the disk. A name that is empty is not kept."""
    kept = _STORES[0].result(job.name) if job.name else None
    if kept is not None:
        return kept
    done = _WORK[job.what](job)
    if job.name:
        _STORES[0].keep(job.name, done)
    return done


def _all(every: Sequence[Job], count: int, progress: Progress, label: str) -> list[Any]:
    """The results of jobs, in their order."""
    progress(label, 0, len(every))
    if count == 1 or len(every) < 2 or "fork" not in multiprocessing.get_all_start_methods():
        found = []
        for job in every:
            found.append(_do(job))
            progress(label, len(found), len(every))
        return found
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(min(count, len(every)), fork, _begun, (os.getpid(),)) as pool:
        return _waited(pool, every, progress, label)


def _begun(parent: int) -> None:
    """A worker begins: an interrupt is the parent's to handle, which ends it; it does not outlive a killed parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_ends_with, args=(parent,), daemon=True).start()


def _ends_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


def _waited(pool: Executor, every: Sequence[Job], progress: Progress, label: str) -> list[Any]:
    futures = [pool.submit(_do, job) for job in every]
    try:
        for done, _ in enumerate(_finished(futures), 1):
            progress(label, done, len(every))
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in multiprocessing.active_children():
            worker.terminate()  # what it was at is not kept; what is kept is whole
        raise
    return [future.result() for future in futures]


def _finished(futures: Iterable[Future[Any]]) -> Iterable[Any]:
    for future in as_completed(futures):
        yield future.result()


def _gathered(plan: Plan, count: int, progress: Progress) -> Outcome:
    """All results of a plan, from the disk."""
    judged: dict[str, dict[str, list[dict[str, Any]]]] = {variant: {} for variant in plan.variants}
    false: dict[str, dict[str, int]] = {variant: dict.fromkeys(plan.detectors, 0) for variant in plan.variants}
    hours = dict.fromkeys(plan.variants, 0.0)
    for form, rates in plan.forms.items():
        for job in _judging(plan, form):
            result = _STORES[0].result(job.name)
            if result is None:
                raise BadInput(job.name, "its result is gone", "run the evaluation again")
            for rate in rates:
                _add(f"{form}-{rate}", job, result[str(rate)], judged, false, hours)
    signs = next((s for form in plan.forms if (s := _STORES[0].result(f"signatures-{form}")) is not None), None)
    groups: dict[int, list[int]] = {}
    for fault, number in (signs or {"group": {}})["group"].items():
        groups.setdefault(number, []).append(int(fault))
    matrix = {int(fault): row for fault, row in (signs or {"matrix": {}})["matrix"].items()}
    return Outcome(
        plan, judged, false, hours, list(groups.values()), matrix, _footprints(plan, judged, count, progress)
    )


def _add(
    variant: str, job: Job, result: Any, judged: dict[str, dict[str, list[dict[str, Any]]]],
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
    judged[variant].setdefault(what.name, []).append(result)


def _footprints(
    plan: Plan, judged: dict[str, dict[str, list[dict[str, Any]]]], count: int, progress: Progress
) -> dict[str, dict[str, float]]:
    """How much the scenarios that some trial of the bank misses move X and F, in the first variant."""
    variant = plan.variants[0]
    form: Form = next(iter(plan.forms))
    missed = [
        name
        for name, trials in judged[variant].items()
        if any(trial["detectors"].get(BANK, {"first": 0})["first"] is None for trial in trials)
    ]
    noise = 2.5e-3, 3e-3
    every = [Job(f"footprint-{form}-{name}", "footprint", form, (name, *noise)) for name in missed]
    return dict(zip(missed, _all(every, count, progress, "what was missed"), strict=True))
