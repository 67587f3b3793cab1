"""Draw, run and write the examination of a release.

    python -m benchmarks.examination --seed 1234 --cases trace=20,fit=20,monitor=10,assess=20,emps=1
    python -m benchmarks.examination --cases fit=4,assess=4 --write       the seed is the commit's

Without --seed it is the first 32 bits of the commit. Every finished case is a line of the results file, and an
examination that is started again goes on behind them. --write adds the score to docs/examinations.md, once.
"""

from __future__ import annotations

import argparse
import datetime
import json
import multiprocessing
import os
import sys
import tomllib
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from benchmarks.examination.score import append, scores, section
from benchmarks.examination.subjects import SUBJECTS, Row, examine
from benchmarks.machine import commit, machine
from benchmarks.measured_data import DATA

DEFAULT = "trace=10,fit=10,monitor=3,assess=12,emps=1"


def asked_cases(text: str) -> list[tuple[str, int]]:
    """``fit=2,assess=1`` as subjects and numbers of cases; raises argparse's error for anything else."""
    found = []
    for item in text.split(","):
        name, _, count = item.partition("=")
        if name not in SUBJECTS or not count.isdigit():
            raise argparse.ArgumentTypeError(f"{item!r} is no SUBJECT=NUMBER; subjects are {', '.join(SUBJECTS)}")
        found += [(name, case) for case in range(int(count))]
    return found


def taken(cases: list[tuple[str, int]], seed: int, head: str, path: Path, workers: int) -> list[Row]:
    """The rows of all cases: those that the file has of this seed and commit, the others as they are examined."""
    path.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    rows = {(row["subject"], row["case"]): row for row in known if (row["seed"], row["commit"]) == (seed, head)}
    with path.open("a") as file, ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        asked = [pool.submit(examine, subject, case, seed) for subject, case in cases if (subject, case) not in rows]
        for done in as_completed(asked):
            row = done.result() | {"commit": head}
            rows[row["subject"], row["case"]] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
            print(json.dumps(row), flush=True)
    return [rows[case] for case in cases]


def main() -> None:
    """Run what is asked for, print the score, and write it where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, help="of all draws; by default the first 32 bits of the commit")
    parser.add_argument("--cases", type=asked_cases, default=asked_cases(DEFAULT), help=f"by default {DEFAULT}")
    parser.add_argument("--results", type=Path, default=Path("build/examination.jsonl"))
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="cases at a time, one thread each")
    parser.add_argument("--write", action="store_true", help="add the score to docs/examinations.md")
    chosen = parser.parse_args()
    if ("emps", 0) in chosen.cases and not (DATA / "emps").is_dir():
        sys.exit("no measured data of EMPS here; set BRISTLE_DATA to their folder, or ask for emps=0")
    head = commit()
    if chosen.write and head.endswith("changes"):
        sys.exit("the tree has changes; commit them, then examine the commit")
    seed = int(head[:8], 16) if chosen.seed is None else chosen.seed
    rows = taken(chosen.cases, seed, head, chosen.results, chosen.workers)
    version = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    processor_s = sum(row["processor_s"] for row in rows)
    about = (
        f"Commit {head[:12]}, seed {seed}, {datetime.datetime.now(datetime.UTC).date()}. "
        f"{machine('numpy', 'casadi')}; load {os.getloadavg()[0]:.0f}; "
        f"{processor_s / 60:.1f} minutes of processor time."
    )
    text = section(f"{version}, seed {seed}", [about, "", *scores(rows)])
    print(text)
    if chosen.write:
        append(text)


if __name__ == "__main__":
    main()
