"""The pieces of an evaluation: which runs are made, learned from and judged, and what all pieces of work share."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from detector.evaluation.benchmark.runs import Setting, healthy, random_start
from detector.evaluation.contract import Detector
from detector.evaluation.detectors import DETECTORS
from detector.evaluation.learned import SETTLE_S, Learned
from detector.evaluation.levels import BLOCK_S
from detector.evaluation.plan import Plan
from detector.evaluation.store import Store
from recordings import Array
from simulator.damadics import Form, scenario

SEEDS = {"learn": 1000, "calibrate": 2000, "judge": 3000, "calibrate-start": 4000, "judge-start": 5000}
"""Seeds of the fault-free runs for each purpose begin here; scenarios take 1, 2, 3, ..."""

START_S = SETTLE_S + 2 * BLOCK_S
"""Length of the short runs [s]: what the benchmark's abrupt scenarios have."""

_DAY_S = 86_400


@dataclass(frozen=True)
class Job:
    """One piece of work. name : of its file, empty for none; what : a key of `detector.evaluation.work.WORK`; form and
    arguments of it.
    """

    name: str
    what: str
    form: Form
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True, eq=False)
class Study:
    """What all work of an evaluation shares. detectors : all that the plan may name; store : of results; learned : what
    the detectors have learned so far, by form and rate.
    """

    plan: Plan
    detectors: Mapping[str, Detector]
    store: Store
    learned: Mapping[tuple[Form, int], Learned] = field(default_factory=dict)

    def rates(self, form: Form) -> tuple[int, ...]:
        """Sampling rates of a form [Hz]."""
        return self.plan.forms[form]

    def pending(self, jobs: Sequence[Job]) -> list[Job]:
        """Those without a result."""
        return [job for job in jobs if self.store.result(job.name) is None]

    def fault_free(self, form: Form, rate: int, job: Job) -> Array:
        """The run of a fault-free job at a rate, (n, 6); made when it is not there."""
        seed, seconds = job.arguments

        def make() -> Array:
            rows = healthy(seconds, setting(form, seed, seconds == START_S), self.rates(form))
            return np.stack([rows[one] for one in self.rates(form)])

        return self.store.run(f"{job.name}-{seconds}", make)[self.rates(form).index(rate)]


def key(plan: Plan, detectors: Mapping[str, Detector]) -> str:
    """Names what everything learned depends on: results of an equal key are resumed.

    A detector of somebody's own is known by its name and its text.
    """
    own = {name: one.text for name, one in detectors.items() if DETECTORS.get(name) is not one}
    if not own:
        return plan.key
    return hashlib.sha256(json.dumps([plan.key, own], sort_keys=True).encode()).hexdigest()[:12]


def fault_free_jobs(plan: Plan, form: Form, purpose: str) -> list[Job]:
    """Fault-free runs for a purpose of `SEEDS`: of a day at most each, or short ones from a start."""
    first = SEEDS[purpose] + plan.seeds_from
    seeds = range(first, first + 1000)
    if purpose.endswith("start"):
        lengths = [START_S] * plan.starts[("calibrate-start", "judge-start").index(purpose)]
    else:
        seconds = round(plan.hours(form)[("learn", "calibrate", "judge").index(purpose)] * 3600)
        lengths = [min(_DAY_S, seconds - started) for started in range(0, seconds, _DAY_S)]
    what = "count" if purpose.startswith("judge") else "healthy"
    return [
        Job(f"{purpose}-{form}-{_rates(plan, form)}-{seed}", what, form, (seed, seconds))
        for seed, seconds in zip(seeds, lengths, strict=False)
    ]


def scored_jobs(plan: Plan, form: Form) -> list[Job]:
    """Scenarios, the long ones first so that no core waits at the end, and fault-free hours to judge."""
    made = [
        Job(f"{name}-{form}-{_rates(plan, form)}-{seed}", "scenario", form, (name, seed))
        for name in plan.scenarios
        for seed in range(plan.seeds_from + 1, plan.seeds_from + plan.trials(form, scenario(name)) + 1)
    ]
    made.sort(key=lambda job: -plan.duration(form, scenario(job.arguments[0])))
    return fault_free_jobs(plan, form, "judge") + made + fault_free_jobs(plan, form, "judge-start")


def setting(form: Form, seed: int, short: bool) -> Setting:
    """How a fault-free run is made; every second of the short ones does not start as the benchmark does."""
    return random_start(form, seed) if short and seed % 2 else Setting(form, seed)


def _rates(plan: Plan, form: Form) -> str:
    """The sampling rates of a form, for names: results at other rates are others."""
    return "-".join(str(rate) for rate in plan.forms[form])
