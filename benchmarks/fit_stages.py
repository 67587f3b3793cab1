"""What each stage, restart and special start of `fit` is good for: the same fits with one of them switched off.

    python -m benchmarks.fit_stages
    python -m benchmarks.fit_stages --only "one start" "no new paths"

A stage is there against fits that do not converge, and against parameters called `identified` that are more than four
standard deviations off. The valves are development seeds of `benchmarks.plant_sampling`, and soft ones at 500 Hz.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.machine import commit, machine
from benchmarks.plant_sampling import GROSS, behind_a_positioner, recordings
from identification import Experiment, Outcome, experiment, fit, uncertainty_of
from simulator import Excitation, Sensors, random_valve, simulate

Made = tuple[dict[str, float], list[Experiment]]
SEARCH = "identification.estimators.output_error.damped"
CHUNKS = "identification.estimators.noise_aware.best_paths"
MENDING = "identification.estimators.noise_aware.mending"
WHOLE = "identification.estimators.noise_aware.search"
PATHS = "identification.estimators.noise_aware.paths"
FULL = "identification.estimators.noise_aware"
COURSES = ("staircase:20", "sine:20")
"""The recordings of a soft valve."""


def nothing(*_: Any, **__: Any) -> None:
    """In the place of what is switched off."""


def as_smooth(_t: Any, _u: Any, force: Any, _motion: Any) -> Any:
    """In the place of what changes a force."""
    return force


def no_runs(*_: Any) -> tuple[()]:
    """In the place of what makes some runs."""
    return ()


def last_of_all(*given: Any) -> Any:
    """In the place of what changes its last argument."""
    return given[-1]


def by_descents(work: Any, now: Any, steps: int = 12) -> Any:
    """In the place of steps along new paths."""
    return work.descend(now, steps), False


SWITCHES: dict[str, Mapping[str, Any]] = {
    "16 starts instead of 64": {f"{SEARCH}.STARTS": 16},
    "four starts, and none of them dropped": {f"{SEARCH}.STARTS": 4, f"{SEARCH}.STEPS": (10,)},
    "no bristle in balance on first paths": {f"{PATHS}.balanced": last_of_all},
    "no runs of the model": {f"{PATHS}.set_back_path": nothing},
    "no looser force on new paths": {f"{CHUNKS}.LOOSE": 1.0},
    "missed slips are not looked for": {f"{MENDING}.ROUNDS": 0},
    "no runs through missed slips": {f"{MENDING}.shots": no_runs},
    "nothing but runs through missed slips": {f"{MENDING}.OTHERS": ()},
    "a missed slip counts in full": {f"{CHUNKS}.ACCIDENT": float("inf")},
    "steps of paths that do harm are kept": {f"{CHUNKS}.WORSE": float("inf")},
    "descents instead of steps along new paths": {f"{CHUNKS}.BestPathsNoiseAware.followed": by_descents},
    "no descents on whole recordings": {f"{WHOLE}.ROUNDS": 0},
    "a force does not answer the motion": {"identification.data.grid.answering": as_smooth},
    "no more static friction": {f"{WHOLE}.HIGHER": (1.0,)},
    "no fit with a rougher force": {f"{WHOLE}.with_rougher_force": nothing},
    "no nodes between samples": {f"{FULL}.resolution.MOST_BETWEEN": 1},
    "no bias of the order": {"identification.estimators.systematic_error.order_bias": nothing},
}  # fmt: skip
STIFF = (
    ("loop", 9103, 50.0), ("stem", 9104, 100.0), ("loop", 9100, 100.0), ("stem", 9105, 50.0), ("stem", 9101, 100.0),
    ("stem", 9102, 200.0),
    ("stem", 10603, 100.0), ("stem", 10909, 100.0), ("loop", 9130, 50.0), ("stem", 10314, 200.0),
)  # fmt: skip
"""Kind, seed and rate [Hz]: a stem test, or a valve in a closed loop; the last four have been astray."""
SOFT = tuple(("soft", seed, 500.0) for seed in (1, 3, 4, 5, 7, 9))


@dataclass(frozen=True)
class Row:
    """What became of one fit. converged : whether it did; wrong : parameters that are called `identified` and are not;
    farthest : error of one, at most, in standard deviations; seconds : of processor time.
    """

    converged: bool
    wrong: tuple[str, ...]
    farthest: float
    seconds: float


def made(kind: str, seed: int, rate: float) -> Made:
    """The true values of a valve, and its recordings at a rate [Hz]."""
    if kind != "soft":
        return (recordings if kind == "stem" else behind_a_positioner)(seed, rate)
    values, stroke = random_valve(seed)
    sensors = Sensors(rate, position_noise=2e-4 * stroke, force_noise=1e-3 * values["spring.K"] * stroke)
    runs = [simulate(values, Excitation.parse(course), sensors, stroke=stroke, seed=seed)[0] for course in COURSES]
    return values, [experiment(run) for run in runs]


def fitted(case: Made, switched: Mapping[str, Any]) -> Row:
    """The fit of a valve with something switched off, against the truth."""
    truth, experiments = case
    start = time.process_time()
    with ExitStack() as stack:
        for target, value in switched.items():
            stack.enter_context(patch(target, value))
        found = fit(experiments)
    seconds = time.process_time() - start
    if found.outcome is not Outcome.CONVERGED:
        return Row(False, (), 0.0, seconds)
    known = uncertainty_of(found)
    claimed = [name for name in known.names if known.status[name] == "identified"]
    off = [abs(found.values[name] - truth[name]) / known.spread[name] for name in claimed]
    wrong = tuple(name for name, far in zip(claimed, off, strict=True) if far > GROSS)
    return Row(True, wrong, max(off, default=0.0), seconds)


def table(switches: Mapping[str, Mapping[str, Any]], cases: Iterable[tuple[str, int, float]], only: list[str]) -> None:
    """Print a row of the table for every switch, once the fits of all cases are made."""
    known = {case: made(*case) for case in cases}
    for label, switched in {"nothing": {}, **switches}.items():
        if only and label not in only:
            continue
        rows = {case: fitted(one, switched) for case, one in known.items()}
        worse = [
            f"{seed} at {rate:g} Hz " + (f"({', '.join(row.wrong)})" if row.converged else "(not converged)")
            for (_, seed, rate), row in rows.items() if row.wrong or not row.converged
        ]  # fmt: skip
        print(
            f"| {label} | {sum(row.converged for row in rows.values())} of {len(rows)} | "
            f"{sum(len(row.wrong) for row in rows.values())} | {max(row.farthest for row in rows.values()):.1f} | "
            f"{np.mean([row.seconds for row in rows.values()]):.1f} s | {'; '.join(worse)} |",
            flush=True,
        )


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--only", nargs="+", default=[], help="rows that are wanted")
    options.add_argument("--orders", nargs="+", default=["damped", "full"], choices=["damped", "full"])
    options.add_argument("--cases", type=int, default=6, help="cases of each order")
    options.add_argument("--first", type=int, default=0, help="the first of them")
    asked = options.parse_args()
    print(machine("casadi", "numpy"), commit())
    print("\n| switched off | converged | wrong claims | farthest | processor time | which |\n" + "| --- " * 6 + "|")
    for order in asked.orders:
        cases = STIFF if order == "damped" else SOFT
        table(SWITCHES, cases[asked.first :][: asked.cases], asked.only)


if __name__ == "__main__":
    main()
