"""Every reader refuses every file of the corpus with one line, without holding what the file unpacks into.

By default all readers work in this one process, on every eighth file. `slow` are all files. `long` are real processes
with their time and memory, and an hour of hypothesis for each reader.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections import Counter
from itertools import count
from pathlib import Path
from time import monotonic
from typing import NamedTuple

import pytest
from hostile_files import MAKERS, MODEL, ROWS, corpus, recording
from hostile_readers import EDITS, FUZZED, READERS, SUFFIXES, WHOLE, complaint, damaged
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from simulator import ValveModel

MOST_BYTES = 300_000_000
MOST_SECONDS = 2.0


@pytest.mark.parametrize("every", [8, pytest.param(1, marks=pytest.mark.slow)])
def test_each_hostile_file_is_refused_in_one_line(tmp_path: Path, every: int) -> None:
    pytest.importorskip("pyarrow")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    counts, wrong = Counter[str](), {}
    for number, (kind, path) in enumerate(corpus(tmp_path)):
        counts[kind] += number % every == 0
        problem = complaint(READERS[kind], path) if number % every == 0 else ""
        if problem:
            wrong[f"{kind}/{path.name}"] = problem
        path.unlink()
    assert wrong == {}
    assert counts.total() >= 400 / every, counts
    assert set(+counts) == set(MAKERS)
    assert 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) < MOST_BYTES


# Real processes, and an hour for each reader


def arguments(kind: str, path: Path, target: Path) -> list[str]:
    """The command that reads a file of a kind."""
    if kind in ("table", "matlab", "parquet", "hdf5"):
        return ["import", str(path), "--to", str(target)]
    if kind == "mapping":
        (path.parent / "table.csv").write_text(ROWS)
        return ["import", str(path.parent / "table.csv"), "--to", str(target), "--mapping", str(path)]
    if kind == "csv-map":
        return ["record", "--source", "tcp://127.0.0.1:1", "--map", str(path), "--to", str(target)]
    if kind == "state":
        model, rig = str(path.parent / "model.json"), str(path.parent / "rig.h5")
        ValveModel.model_validate(MODEL).write(model)
        recording(Path(rig)).close()
        return ["replay", rig, "--model", model, "--state", str(path)]
    if kind == "plant":
        return ["monitor", "--check", str(path)]
    if kind == "served-plant":
        return ["serve", "--plant", str(path), "--listen", "tcp://127.0.0.1:0"]
    return ["show", str(path)]


class Cost(NamedTuple):
    """What one process took: processor time [s] with that of its children, and the most memory [bytes]."""

    seconds: float
    memory: int
    file: str


WITNESS = """
import resource, subprocess, sys
code = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(code, used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss)
"""
"""Runs a command and says what it took. A child of this large process would begin with its memory counted."""


def refused(kind: str, path: Path, target: Path) -> tuple[Cost, str]:
    """What the command took to refuse a file, and what is wrong with how it did; empty for nothing."""
    command = [sys.executable, "-m", "bristle", "--quiet", *arguments(kind, path, target)]
    run = subprocess.run([sys.executable, "-S", "-c", WITNESS, *command], capture_output=True, text=True, check=True)
    code, seconds, memory = run.stdout.split()
    cost = Cost(float(seconds), int(memory), f"{kind}/{path.name}")
    if code != "2" or run.stderr.count("\n") != 1 or target.exists():
        return cost, f"exit {code}, {run.stderr[-300:]!r}"
    too_much = cost.memory > MOST_BYTES or cost.seconds > MOST_SECONDS
    return cost, f"{cost.seconds:.2f} s, {cost.memory // 1_000_000} MB" if too_much else ""


@pytest.mark.long
def test_each_hostile_file_is_refused_by_a_process_of_its_own(tmp_path: Path) -> None:
    """With the table of the dearest. BRISTLE_HOSTILE_STRIDE takes every n-th file only."""
    stride, costs, wrong = int(os.environ.get("BRISTLE_HOSTILE_STRIDE", "1")), list[Cost](), {}
    for number, (kind, path) in enumerate(corpus(tmp_path)):
        if number % stride == 0 or "bomb" in path.name or path.stat().st_size > 1_000_000:
            cost, problem = refused(kind, path, tmp_path / "out.h5")
            costs.append(cost)
            if problem:
                wrong[cost.file] = problem
        path.unlink()
    dearest = [*sorted(costs, reverse=True)[:5], *sorted(costs, key=lambda cost: -cost.memory)[:5]]
    print(f"{len(costs)} processes", *(f"{s:.2f} s {m // 1_000_000} MB {name}" for s, m, name in dearest), sep="\n")
    assert wrong == {}


FUZZ_SECONDS = float(os.environ.get("BRISTLE_FUZZ_SECONDS", "190"))
"""For each reader: an hour for all of them."""

MOST_PER_FILE_S = 10.0
"""Processor time for one damaged file, that of a child which tries it first included."""


def used() -> float:
    return sum(os.times()[:4])


@pytest.mark.long
@pytest.mark.parametrize("kind", list(FUZZED))
def test_no_damage_to_a_file_is_a_traceback(kind: str, tmp_path: Path) -> None:
    """Damage to a whole file, and to any of the corpus: it is read, or refused in one line."""
    seeds = [WHOLE[kind](tmp_path)]
    for _, one in corpus(tmp_path, kind) if kind in MAKERS else ():
        if one.stat().st_size < 100_000:
            seeds.append(one.read_bytes())
        one.unlink()
    path, ends, end = tmp_path / f"damaged{SUFFIXES[kind]}", Counter[str](), monotonic() + FUZZ_SECONDS
    files = st.one_of(st.just(seeds[0]), st.sampled_from(seeds))

    def check(data: bytes, edits: list[tuple[int, int, bytes]]) -> None:
        path.write_bytes(damaged(data, edits))
        before = used()
        problem = complaint(FUZZED[kind], path)
        ends["read" if problem else "refused"] += 1
        assert problem in ("", "it was read")
        assert used() - before < MOST_PER_FILE_S

    for number in count():
        if monotonic() > end:
            break
        again = settings(max_examples=100, deadline=None, database=None, suppress_health_check=list(HealthCheck))
        seed(number)(again(given(files, EDITS)(check)))()
    memory = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    print(f"{kind}: {ends.total()} damaged files, {ends['read']} of them read; peak {memory // 1000} MB")
