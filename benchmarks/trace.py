"""How often `trace` names the effect that a plant has, on recordings of a plant it shares no code with.

    python -m benchmarks.trace                            everything (many hours on two cores)
    python -m benchmarks.trace --parts single --ids backlash,dead_time --valves 101 --strengths 6      a look
    python -m benchmarks.trace --parts controls --controls 20 --jobs 2
    python -m benchmarks.trace --parts controls --controls 20 --rig       the same, as a rig would record it
    python -m benchmarks.trace --release --seed 1 --parts controls        of a release what lacks nothing
    python -m benchmarks.trace --release --seed 1 --rig                   and of that the complete rigs alone
    python -m benchmarks.trace --report                   the tables of what has been run
    python -m benchmarks.trace --release --seed 7 --minutes 30            a release's table: benchmarks/trace_release.py
    python -m benchmarks.trace --ablation --valves 7001                   what each number does: trace_ablation.py

The plant is that of `benchmarks.plants`; strengths are the root mean square of an effect that is left in the position
when the base model is fitted again, in standard deviations of the position noise; force noise is 0.1 % of the span.
Fitted to: a staircase of 40 s and a sine of 50 s; held out: a multisine of 40 s. Every finished case is a line of the
results file, and a study that is started again goes on behind them.

Two effects are invisible unless something of the plant is known, and it is given: the preload for
asymmetric_coulomb; mass, spring and preload for force_gain.

Right: the verdict is the effect, or the effect is in the class that the verdict stands for. Wrong: any other effect's
name. `none` and `unlisted` are misses. The true model's error is that of the plant itself on the recorded force, raw or
smoothed, whichever is least.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from scipy.signal import savgol_filter

from benchmarks import trace_ablation, trace_release
from benchmarks.machine import commit, machine, today
from benchmarks.plants.cases import COURSE, Case, force_course
from benchmarks.plants.effects import HELD, KNOWN, OUTSIDE, SAME, Valve, fields_of
from benchmarks.plants.integration import integrate
from benchmarks.plants.recordings import recordings
from benchmarks.plants.strengths import MULTIPLES, reached
from benchmarks.trace_release import SLOW, good
from benchmarks.trace_report import PARTS, Row, report, scored
from benchmarks.trace_truth import gain_of_truth, has_truth
from identification.estimators import KalmanSmoother
from recordings import Recording

VALVES = (101, 102, 103)
RESULTS = Path("build/trace-study.jsonl")
PAIRS = (
    ("position_dependent_friction", "backlash"),
    ("friction_drift", "hardening_spring"),
    ("dwell_stiction", "sensor_drift"),
    ("quadratic_drag", "periodic_force"),
    ("contact_stiffness", "frictional_memory"),
    ("dead_time", "position_dependent_friction"),
    ("flow_force", "friction_drift"),
    ("load_dependent_friction", "actuator_hysteresis"),
    ("sensor_lag", "force_offset_drift"),
    ("asymmetric_viscous", "sensor_nonlinearity"),
)
SMOOTHING = (0.06, 0.12, 0.24)
"""Windows [s] over which the recorded force is smoothed for the true model."""
Tracer = Callable[..., Any]
Examiner = Callable[[str, Case, Tracer | None], Row]


def cases(part: str, asked: argparse.Namespace) -> Iterator[Case]:
    """The cases of one part of the study."""
    ids, strengths = asked.ids, asked.strengths
    if part == "controls":
        yield from (control(i) for i in range(asked.controls))
        return
    for valve in asked.valves:
        if part == "single":
            yield from (Case(valve, (e,), s, asked.form) for e in ids or SAME if e in SAME for s in strengths)
        elif part == "outside":
            yield from (Case(valve, (e,), s) for e in ids or OUTSIDE if e in OUTSIDE for s in strengths if s > 3)
        elif part == "pairs":
            pairs = [pair for pair in PAIRS if not ids or {*pair} & {*ids}]
            yield from (Case(valve, pair, s, asked.form) for pair in pairs for s in strengths if s > 3)
        else:
            for rate, slow in SLOW:
                yield from (Case(valve, (e,), 6.0, asked.form, rate, slow) for e in ids or SAME if e in SAME)


def control(i: int) -> Case:
    """The i-th set of recordings without an effect: its own valve, noise of 1/2 to 2 times the usual, its own rate."""
    rng = np.random.default_rng([i, 11])
    noise, rate = rng.choice([0.5, 1.0, 1.0, 2.0]), rng.choice([500.0, 500.0, 250.0, 100.0])
    slow = "position" if rate < COURSE and rng.random() < 0.5 else "both"
    return Case(1000 + i, noise=float(noise), rate=float(rate), slow=slow)


def examine(part: str, case: Case, tracer: Tracer | None = None) -> Row:
    """Make the recordings of a case, trace them, and say what came out. An exception is an answer too: `failed`."""
    if tracer is None:
        from identification import trace as tracer
    fitted, held_out, strengths = recordings(case)
    row: Row = {"part": part, "name": case.name, **asdict(case), "strengths": strengths, "reached": reached(case)}
    clock, processor, nodes = time.perf_counter(), time.process_time(), list[int]()
    try:
        with nodes_of_passes(nodes):
            found = tracer(fitted, holdout=held_out, **known(case))
        row |= {
            "verdict": found.verdict, "complete": found.complete,
            "added": list(found.effects_added), "same_class": list(found.same_class),
            "before": holdout_error(found.error, "before"), "after": holdout_error(found.error, "after"),
            "tried": [(c.effect, c.gain, c.held_out.gain, c.held_out.p_value) for c in found.candidates if c.held_out],
        }  # fmt: skip
    except Exception as error:
        row |= {"verdict": "failed", "added": [], "same_class": [], "why": f"{type(error).__name__}: {error}"[:300],
                "where": traceback.format_exc()[-600:]}  # fmt: skip
    row |= {"seconds": time.perf_counter() - clock, "processor": time.process_time() - processor,
            "true": true_error(case, held_out[0], strengths), "samples": sum(map(len, fitted)),
            "passes": sum(nodes) / sum(map(len, fitted)),
            "peak_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}  # fmt: skip
    return row


@contextmanager
def nodes_of_passes(nodes: list[int]) -> Iterator[None]:
    """Inside, the number of nodes of every pass of the noise-aware estimator is noted."""
    line = KalmanSmoother.line

    def noted(self: KalmanSmoother, kernel: Any, coordinates: Any, grid: Any, p: Any, path: Any, freedom: Any) -> Any:
        nodes.append(len(path))
        return line(self, kernel, coordinates, grid, p, path, freedom)

    with mock.patch.object(KalmanSmoother, "line", noted):
        yield


def examine_for_release(part: str, case: Case, tracer: Tracer | None = None) -> Row:
    """The same without what was tried, and where it missed what the catalogue has, with what the truth gains."""
    row = examine(part, case, tracer) | {"where_run": f"{today()}, {machine('casadi', 'numba', 'numpy', 'scipy')}"}
    for item in ("tried", "where"):
        row.pop(item, None)
    if not good(row) and has_truth(case):
        row["gain_of_truth"] = gain_of_truth(case, **known(case))
    return row


def known(case: Case) -> dict[str, dict[str, float]]:
    """What a user would have to give, as an option of `trace`, for the effects of a case to be told from the base."""
    items = [HELD[item] for effect in case.effects for item in KNOWN.get(effect, ())]
    return {"given": {name: Valve.of(case.valve).values[name] for name in items}} if items else {}


def holdout_error(error: Any, when: str) -> float | None:
    """Free-run error on the held-out recording [m], from the mapping or the object that a trace has as its error."""
    for item in (when, "holdout", "rmse_m"):
        error = error.get(item) if isinstance(error, dict) else getattr(error, item, None)
    return None if error is None else float(error)


def true_error(case: Case, recording: Recording, strengths: dict[str, float]) -> float:
    """Free-run error of the plant itself on the recorded force [m]: the least over several ways of smoothing that.

    On the raw force it is far above the noise where the plant sticks and slips: noise lets it slip too early.
    """
    valve = Valve.of(case.valve)
    fields = fields_of(strengths, valve, case.form)
    t, measured, force = recording.time, recording["position"].values, recording["force"].values
    seen, errors = np.isfinite(measured), []
    fine = np.arange(round(t[-1] * COURSE) + 1) / COURSE
    dt = float(np.median(np.diff(t)))
    windows = [max(2 * round(seconds / dt / 2) + 1, 5) for seconds in SMOOTHING]
    rest = force_course(valve, "multisine", float(t[-1]), case.seed)[0]
    for recorded in (force, *(savgol_filter(force, window, 3) for window in windows)):
        recorded = np.r_[rest, recorded[1:]]  # the plant starts where it was at rest
        out = integrate(valve.physics(fields), np.interp(fine, t, recorded), COURSE)
        errors.append(np.sqrt(np.mean((np.interp(t, fine, out[:, 0]) - measured)[seen] ** 2)))
    return float(min(errors))


def known_rows(path: Path) -> list[Row]:
    """What a results file holds; a line that was cut off is left out."""
    rows = []
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return rows


def study(
    work: Iterable[tuple[str, Case]], path: Path, jobs: int, tracer: Tracer | None = None, minutes: float = np.inf,
    examiner: Examiner = examine,
) -> list[Row]:  # fmt: skip
    """Run all cases that the results file does not have, and add them to it one by one. Returns all its rows.

    minutes : of processor time after which no other case is run; examiner : of one case.
    """
    rows, spent = known_rows(path), 0.0
    done = {(row["part"], row["name"]) for row in rows}
    left = [(part, case) for part, case in work if (part, case.name) not in done]
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+") as file:
        file.seek(max(file.tell() - 1, 0))
        if file.read(1) not in ("", "\n"):  # a line was cut off
            file.write("\n")
        for i, row in enumerate(results(left, jobs, tracer, examiner), 1):
            file.write(json.dumps(row) + "\n")
            file.flush()
            rows.append(row)
            said = f"{row['verdict']} ({scored(row)}, {row['seconds']:.0f} s)"
            print(f"{i}/{len(left)} {row['part']} {row['name']}: {said}", flush=True)
            spent += row["processor"]
            if spent > 60 * minutes:
                break
    return rows


def results(
    work: Sequence[tuple[str, Case]], jobs: int, tracer: Tracer | None, examiner: Examiner
) -> Iterator[Row]:  # fmt: skip
    """The rows of some cases, by one process or several."""
    if jobs < 2:
        yield from (examiner(part, case, tracer) for part, case in work)
        return
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, spawn, max_tasks_per_child=1) as pool:  # their peaks of memory are of one case each
        waiting = [pool.submit(examiner, part, case, tracer) for part, case in work]
        try:
            yield from (future.result() for future in waiting)
        finally:
            pool.shutdown(cancel_futures=True)


def options(words: Sequence[str] | None = None) -> argparse.Namespace:
    """What was asked for on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    listed = {"single": SAME, "outside": OUTSIDE}
    parser.add_argument("--parts", type=_names(PARTS), default=PARTS, help=f"of {', '.join(PARTS)}; by default all")
    parser.add_argument("--ids", type=_names([*listed["single"], *listed["outside"]]), default=(), help="effects by id")
    parser.add_argument("--valves", type=_numbers(int), default=VALVES, help="seeds of valves")
    parser.add_argument("--strengths", type=_numbers(float), default=MULTIPLES, help="multiples of the noise")
    parser.add_argument("--form", choices=("same", "other"), default="same", help="the catalogue's laws, or others")
    parser.add_argument("--controls", type=int, default=200, help="number of sets without an effect")
    parser.add_argument("--results", type=Path, default=RESULTS, help="file to add to and to go on from")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    parser.add_argument("--rig", action="store_true", help="recordings of a rig, of a release its complete rigs")
    parser.add_argument("--ablation", action="store_true", help="each number doubled, halved, or its rule off")
    made = trace_ablation.CHANGES
    parser.add_argument("--changes", type=_names(made), default=made, help="of a number in an ablation, like off")
    parser.add_argument(
        "--release", action="store_true", help="the table of a release, of the valves that --seed draws"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the draws of a release")
    parser.add_argument("--minutes", type=float, default=np.inf, help="processor time after which no case is begun")
    parser.add_argument("--report", action="store_true", help="run nothing, print the tables of the results file")
    return parser.parse_args(words)


def _names(known: Iterable[str]) -> Callable[[str], tuple[str, ...]]:
    def names(text: str) -> tuple[str, ...]:
        asked = tuple(text.split(","))
        if unknown := {*asked} - {*known}:
            raise argparse.ArgumentTypeError(f"there is no {', '.join(sorted(unknown))}; there are {', '.join(known)}")
        return asked

    return names


def _numbers(kind: Callable[[str], Any]) -> Callable[[str], tuple[Any, ...]]:
    return lambda text: tuple(kind(item) for item in text.split(","))


def in_time(*given: Any, **options: Any) -> Any:
    """A trace with the budget that one of a release has."""
    from identification import trace as tracer

    return tracer(*given, budget=trace_release.BUDGET, **options)


def release(asked: argparse.Namespace) -> None:
    """Run what is left of the table of a release, and write its page."""
    head = commit(trace_release.MEASURED, trace_release.LEFT_OUT)
    work = trace_release.drawn(asked.seed, PAIRS)
    work = [one for one in work if one[0] in asked.parts and (one[1].rig or not asked.rig)]
    named = {(part, case.name) for part, case in work}
    path = trace_release.results_of(asked.seed, head)
    if asked.report:
        rows = known_rows(path)
    else:
        rows = study(work, path, asked.jobs, in_time, asked.minutes, examine_for_release)
    text = trace_release.section(asked.seed, head, [row for row in rows if (row["part"], row["name"]) in named], work)
    if asked.rig or asked.parts != PARTS:  # a part of the table is no table
        print(text)
        return
    page = trace_release.PAGE.read_text(encoding="utf-8") if trace_release.PAGE.exists() else ""
    trace_release.PAGE.write_text(trace_release.written(page, asked.seed, text), encoding="utf-8")
    print(text)


def main() -> None:
    """Run what is asked for and print all tables."""
    asked = options()
    print(machine("casadi", "numba", "numpy", "scipy"), f"load {os.getloadavg()[0]:.1f}")
    if asked.release:
        release(asked)
        return
    if asked.ablation:
        some = list(trace_ablation.cases(asked.valves, asked.ids, rig=asked.rig))
        rows = trace_ablation.ablation(some, asked.minutes, changes=asked.changes)
        print("", *trace_ablation.table(rows), sep="\n")
        return
    work = [] if asked.report else [
        (part, replace(case, rig=asked.rig)) for part in asked.parts for case in cases(part, asked)
    ]  # fmt: skip
    report(study(work, asked.results, asked.jobs, minutes=asked.minutes))


if __name__ == "__main__":
    main()
