"""All detectors on the benchmark's 44 scenarios: what is detected, how soon, at which rate of false alarms.

    python -m benchmarks.scenarios            everything, into the folder scenarios
    python -m benchmarks.scenarios --main     the published friction and sampling only
    python -m benchmarks.scenarios --main --detectors bank,kalman --long-seeds 1 --hours 24,48,48     a part of it

Goals: 36 of 44 scenarios detected; median time of the abrupt ones below 10 s; right fault or group first in 80 % of
the detected; false alarms at or below the stated rate; every detection better than the random alarm at 99 %.
Interrupted, it goes on where it stopped.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

from benchmarks.machine import machine
from benchmarks.measured_data import PLANT_HOUR
from detector.evaluation import (
    DETECTORS,
    MAIN,
    VARIANTS,
    Evaluation,
    Plan,
    count_alarms,
    evaluate,
    isolation_words,
    plant_hour,
    plant_table,
    tables,
    write,
)


def show_progress(label: str, done: int, total: int) -> None:
    """Progress on a terminal, a line a stage elsewhere."""
    if sys.stderr.isatty() or done == total:
        print(f"\r{label}: {done} of {total}", end="" if sys.stderr.isatty() else "\n", file=sys.stderr, flush=True)


def report(outcome: Evaluation) -> None:
    """The tables that the goals are about."""
    for table in tables(outcome):
        if table.name in ("summary", "unseen"):
            print(table.markdown())
    print("isolation:", isolation_words(outcome))


def planned(options: argparse.Namespace) -> Plan:
    """The evaluation that the options ask for."""
    learn, calibrate, judge = (float(hours) for hours in options.hours.split(","))
    return Plan(
        tuple(options.detectors.split(",")), variants=(MAIN,) if options.main else VARIANTS, seeds=options.seeds,
        long_seeds=options.long_seeds, healthy_h=(learn, calibrate, judge), examples=options.examples,
        long_h=options.long_hours, seeds_from=options.seeds_from,
    )  # fmt: skip


def main() -> None:
    """Run, write the files, print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("scenarios"), help="folder for tables, page and results")
    parser.add_argument("--main", action="store_true", help="the published friction and sampling only")
    parser.add_argument("--seeds", type=int, default=5, help="trials of each scenario")
    parser.add_argument("--long-seeds", type=int, default=3, help="trials of each day-long scenario")
    parser.add_argument("--detectors", default=",".join(DETECTORS), help="separated by commas; all otherwise")
    parser.add_argument("--hours", default="24,96,96", help="fault-free hours to learn, to calibrate and to judge")
    parser.add_argument("--examples", type=int, default=4, help="runs per fault for the signatures; 0: no isolation")
    parser.add_argument("--long-hours", type=float, default=24.0, help="for how long day-long faults are followed")
    parser.add_argument("--seeds-from", type=int, default=0, help="added to the seed of every run, for fresh ones")
    parser.add_argument("--workers", type=int, default=0, help="processes; 0 for one per core")
    options = parser.parse_args()
    plan = planned(options)
    print(machine("numpy", "scipy", "numba", "filterpy"))
    start = time.perf_counter()
    outcome = evaluate(plan, options.out, show_progress, options.workers or None)
    more = []
    if PLANT_HOUR.exists():
        run = plant_hour(PLANT_HOUR)
        counts = count_alarms(run, plan.detectors, plan.rate_per_h)
        more = [plant_table(counts, plan.rate_per_h, len(run) * 2 / 3 / 3600)]
        print(more[0].markdown())
    write(outcome, options.out, more)
    report(outcome)
    print(f"took {time.perf_counter() - start:.0f} s, {sum(os.times()[:4]):.0f} s of processor time in all processes")


if __name__ == "__main__":
    main()
