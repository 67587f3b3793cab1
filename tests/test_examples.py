"""Every example runs as its first lines say, in a process of its own, and leaves the files that it names."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parents[1]

WRITTEN = {
    "fit_arrays": ("model.json", "report.html"),
    "trace_effect": ("trace.json", "traced.json", "trace.html"),
    "own_effect": ("magnet-model.json", "magnet.html"),
    "record_and_watch": ("healthy.h5", "broken.h5", "watched.html"),
    "own_detector": ("evaluation.md", "evaluation.html"),
}
SAID = {
    "fit_arrays": "converged",
    "trace_effect": "cubic part: ",
    "own_effect": "pull: 1",
    "record_and_watch": "0 alarms",
    "own_detector": "flow     found in 1 of 1",
}
SHOWN = {"own_detector": ("evaluation.html", "flow against position")}
"""What a page must show besides."""


def test_every_example_is_run():
    assert {path.stem for path in (HOUSE / "examples").glob("*.py")} == set(WRITTEN) == set(SAID)


@pytest.mark.parametrize(
    "name", ["fit_arrays", *(pytest.param(name, marks=pytest.mark.slow) for name in WRITTEN if name != "fit_arrays")]
)
def test_an_example_runs(name, tmp_path):
    command = [sys.executable, str(HOUSE / "examples" / f"{name}.py"), str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(HOUSE), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, text=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert SAID[name] in done.stdout
    for file in WRITTEN[name]:
        assert (tmp_path / file).stat().st_size > 0
    if name in SHOWN:
        page, words = SHOWN[name]
        assert words in (tmp_path / page).read_text(encoding="utf-8")
