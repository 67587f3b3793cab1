"""Every n-th call of the system fails, in the recorder, in the monitor, and in the writer's memory: nothing that was
acknowledged is missing afterwards, and what is said is one line that names the place.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parents[1]
COMPILER = shutil.which("cc")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="calls are made to fail by a small library in C")


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("library") / "failing_calls.so"
    subprocess.run([COMPILER, "-shared", "-fPIC", "-O1", "-o", made, HERE / "failing_calls.c", "-ldl"], check=True)
    return made


def outcome(library: Path, folder: Path, scenario: str, stride: int, *more: Path) -> dict:
    """How many cases there were, how they ended, and what was wrong."""
    command = [sys.executable, HERE / "io_faults.py", folder, scenario, str(stride), *more]
    run = subprocess.run(
        list(map(str, command)), env=os.environ | {"LD_PRELOAD": str(library)}, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    "stride", [1201, pytest.param(401, marks=pytest.mark.slow), pytest.param(1, marks=pytest.mark.long)]
)
def test_nothing_acknowledged_is_lost_when_a_call_of_the_recorder_fails(library, tmp_path, stride):
    found = outcome(library, tmp_path / "case", "record", stride)
    assert found["wrong"] == []
    assert found["cases"] > 20
    assert {"ended", "refused"} <= set(found["ends"])


@pytest.mark.parametrize(
    ("calls", "stride", "n_cases"),
    [
        ("monitor:fsync,open", 997, 3),
        pytest.param("monitor", 997, 14, marks=pytest.mark.slow),
        pytest.param("monitor", 29, 50, marks=pytest.mark.long),
    ],
)
def test_the_watching_goes_on_whatever_fails_and_no_recorded_sample_is_lost(
    library, tmp_path, model, healthy, calls, stride, n_cases
):
    found = outcome(library, tmp_path / "case", calls, stride, model, healthy)
    assert found["wrong"] == []
    assert found["cases"] >= n_cases
    print(found)


@pytest.mark.parametrize("stride", [101, pytest.param(1, marks=pytest.mark.long)])
def test_nothing_acknowledged_is_lost_when_memory_runs_out(library, tmp_path, stride):
    pytest.importorskip("_testcapi", reason="allocations are made to fail by CPython's own test module")
    found = outcome(library, tmp_path / "case", "memory", stride)
    assert found["wrong"] == []
    assert found["cases"] > 0


@pytest.mark.parametrize(
    "stride", [251, pytest.param(37, marks=pytest.mark.slow), pytest.param(1, marks=pytest.mark.long)]
)
def test_nothing_acknowledged_is_lost_when_an_allocation_of_the_hdf5_library_fails(library, tmp_path, stride):
    found = outcome(library, tmp_path / "case", "malloc", stride)
    assert found["wrong"] == []
    assert found["cases"] > 10
    print(found)
