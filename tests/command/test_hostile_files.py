"""Every reader refuses every file of the corpus with one line, without holding what the file unpacks into.

By default all readers work in this one process, on every eighth file. `slow` are all files. `long` are real processes
with their time and memory, and an hour of hypothesis for each reader.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hostile_files import MAKERS, MODEL, ROWS, SUFFIX, corpus, recording
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bristle.cli.tracing import trace_words
from hil import PlantFile, RegisterMap, ServicePlan, load_state
from recordings import BadInput, read
from recordings.importers import import_file, load_mapping
from simulator import ValveModel

MOST_BYTES = 300_000_000
MOST_SECONDS = 2.0


def with_mapping(path: Path) -> object:
    """A table whose columns only a mapping could name."""
    table = path.parent / "good table.csv"
    table.write_text(ROWS)
    return import_file(table, load_mapping(path))


READERS: Mapping[str, Callable[[Path], object]] = {
    "recording": read,
    "table": import_file,
    "matlab": import_file,
    "parquet": import_file,
    "hdf5": import_file,
    "model": ValveModel.read,
    "trace": trace_words,
    "state": lambda path: load_state(path, "m"),
    "map": RegisterMap.load,
    "csv-map": RegisterMap.load,
    "mapping": with_mapping,
    "plant": lambda path: ServicePlan.of(PlantFile.read(path)),
}


def complaint(reader: Callable[[Path], object], path: Path) -> str:
    """What is wrong with how a file is refused; empty for nothing."""
    try:
        reader(path)
    except BadInput as error:
        words = str(error)
        return "" if "\n" not in words and len(words) < 2000 and str(path.parent) in words else f"said {words[:2000]!r}"
    except Exception as error:  # a defect: it would be a traceback
        return f"raised {error!r:.300}"
    return "it was read"


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
    assert set(+counts) == set(READERS)
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
    return ["show", str(path)]


@pytest.mark.long
def test_each_hostile_file_is_refused_by_a_process_of_its_own(tmp_path: Path) -> None:
    wrong, target = {}, tmp_path / "out.h5"
    for kind, path in corpus(tmp_path):
        command = [sys.executable, "-m", "bristle", *arguments(kind, path, target)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=os.environ)
        assert process.stderr is not None
        words = process.stderr.read().decode()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds, memory = used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss
        if process.returncode != 2 or words.count("\n") != 1 or memory > MOST_BYTES or seconds > MOST_SECONDS:
            wrong[f"{kind}/{path.name}"] = (process.returncode, words[-300:], round(seconds, 2), memory // 1_000_000)
        assert not target.exists()
        path.unlink()
    assert wrong == {}


def damaged(data: bytes, edits: list[tuple[int, int, bytes]]) -> bytes:
    """A file with some stretches replaced."""
    for place, length, new in edits:
        start = place % (len(data) + 1)
        data = data[:start] + new + data[start + length :]
    return data


EDITS = st.lists(st.tuples(st.integers(0, 1 << 20), st.integers(0, 40), st.binary(max_size=40)), min_size=1, max_size=6)


@pytest.mark.long
@pytest.mark.parametrize("kind", list(MAKERS))
def test_no_damage_to_a_file_is_a_traceback(kind: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Damage to any file of the corpus: it is read, or refused in one line. HYPOTHESIS_EXAMPLES says how long."""
    folder = tmp_path_factory.mktemp("fuzz")
    seeds = [path.read_bytes() for _, path in corpus_of(kind, folder) if path.stat().st_size < 100_000]
    path = folder / f"damaged{SUFFIX[kind]}"

    @settings(
        max_examples=int(os.environ.get("HYPOTHESIS_EXAMPLES", "20000")),
        deadline=None,
        suppress_health_check=list(HealthCheck),
        derandomize=True,
    )
    @given(st.sampled_from(seeds), EDITS)
    def check(data: bytes, edits: list[tuple[int, int, bytes]]) -> None:
        path.write_bytes(damaged(data, edits))
        problem = complaint(READERS[kind], path)
        assert problem in ("", "it was read")

    check()
    shutil.rmtree(folder)


def corpus_of(kind: str, folder: Path) -> list[tuple[str, Path]]:
    return [(one, path) for one, path in corpus(folder) if one == kind]
