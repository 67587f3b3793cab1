"""What runs where Python lacks the modules of Unix, and where another package has one of our names."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parents[2]
HIDDEN = """
import os, sys
import serial  # has a part of its own for each system
for name in ("fcntl", "termios", "tty", "pty", "resource", "grp", "pwd"):
    sys.modules[name] = None
for name in ("fork", "getuid", "getgid", "O_CLOEXEC"):
    delattr(os, name)
sys.path.insert(0, {house!r})
"""


def without_unix(program: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a program where those modules and functions do not exist."""
    text = HIDDEN.format(house=str(HOUSE)) + textwrap.dedent(program)
    return subprocess.run([sys.executable, "-c", text], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_import_show_and_export_run_without_the_modules_of_unix(tmp_path):
    rows = "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(50))
    (tmp_path / "rig.csv").write_text("time (s),position (mm),force (N)\n" + rows)
    program = """
        from bristle.cli.app import run
        import bristle as br
        assert run(["import", "rig.csv", "--to", "rig.h5"]) == 0
        assert len(br.read("rig.h5")) == 50
        assert run(["show", "rig.h5"]) == 0
        assert run(["export", "rig.h5", "--to", "matlab"]) == 0
        assert run(["import", "rig.mat", "--to", "again.h5"]) == 0
        assert run(["simulate", "--to", "valve.h5", "--excite", "step:1"]) == 0
    """
    done = without_unix(program, tmp_path)
    assert done.returncode == 0, done.stderr
    assert {"rig.h5", "again.h5", "valve.h5"} <= {path.name for path in tmp_path.iterdir()}


def test_what_needs_linux_says_so(tmp_path):
    done = without_unix(
        """
        from bristle.cli.app import run
        sys.exit(run(["serve", "--listen", "pty:", "--duration", "1"]))
        """,
        tmp_path,
    )
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2, done.stderr
    assert line.startswith("bristle: this needs Linux: Python has no module ")


@pytest.mark.slow
def test_fit_and_trace_run_without_the_modules_of_unix(tmp_path):
    program = """
        from bristle.cli.app import run
        assert run(["fit", "bundled:step", "--out", "model.json"]) == 0
        assert run(["simulate", "--to", "valve.h5", "--excite", "mixed:3", "--position-noise", "1e-6"]) == 0
        assert run(["trace", "valve.h5", "--budget", "1", "--out", "trace.json"]) in (0, 1)
        assert run(["show", "trace.json"]) == 0
        assert run(["export", "model.json", "--to", "c"]) == 0
    """
    done = without_unix(program, tmp_path)
    assert done.returncode == 0, done.stderr
    assert {"model.json", "trace.json", "model.c", "model.h"} <= {path.name for path in tmp_path.iterdir()}


def started(folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The console command with some environment; another folder goes before ours."""
    path = f"{folder}:{HOUSE}"
    command = [sys.executable, "-c", "from bristle.cli import main; main()", "--version"]
    return subprocess.run(
        command, cwd="/", env={"PYTHONPATH": path, **environment}, capture_output=True, text=True, check=False
    )


def test_a_package_of_the_same_name_is_told_in_one_line(tmp_path):
    assert started(tmp_path).returncode == 0
    (tmp_path / "detector.py").write_text("raise RuntimeError('not ours')\n")
    done = started(tmp_path)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line == (
        f"bristle: the package 'detector' is {tmp_path / 'detector.py'}, not Bristle's in {HOUSE / 'detector'}; "
        "remove or rename it, or use an environment without it"
    )
    (tmp_path / "detector.py").unlink()
    (tmp_path / "hil").mkdir()  # a folder without an __init__ stands behind a package, and takes nothing
    assert started(tmp_path).returncode == 0
    (tmp_path / "hil" / "__init__.py").touch()
    assert f"is {tmp_path / 'hil'}, not" in started(tmp_path).stderr
