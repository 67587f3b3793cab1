"""What the page on recordings says is true: its commands, its Python and its mapping run."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from dying_writer import values
from recording_samples import SPECS

from bristle.cli.app import run
from recordings import UNITS, RecordingWriter, read, validate
from recordings.importers import import_file, mapping_names, mapping_of

PAGE = (Path(__file__).resolve().parents[2] / "docs/recordings.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rig.csv").write_text("t,stem,thrust\n0,1,0.1\n10,2,0.2\n20,3,0.3\n")
    Path("log.txt").write_text("1 4\n2 12\n3 20\n")
    writer = RecordingWriter("cut-off.h5", SPECS)
    writer.append(values(50))
    journal = Path("cut-off.h5.journal").read_bytes()
    writer.close()
    Path("cut-off.h5.journal").write_bytes(journal)
    commands = [line for block in blocks("sh") for line in block.splitlines()]
    for line in sorted(commands, key=lambda line: " show " in line):  # a file is made before it is shown
        assert run(shlex.split(line)[1:]) == 0, line
    np.testing.assert_allclose(read("log.h5")["position"].values, [0.0, 0.01, 0.02])
    assert len(read("whole.h5")) == 50


def test_the_python_runs(tmp_path: Path) -> None:
    (code,) = blocks("python")
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    assert validate(tmp_path / "stem.h5") == []


def test_the_mapping_works(tmp_path: Path) -> None:
    (text,) = blocks("toml")
    rows = "".join(f"{k};0;0;1,5;{k},5\n" for k in range(20))
    (tmp_path / "rig.csv").write_text("t;a;b;p;x\n" + rows)
    made = import_file(tmp_path / "rig.csv", mapping_of(tomllib.loads(text), "docs/recordings.md")).recording
    assert (len(made), made.title) == (5, "Test rig 4")
    np.testing.assert_allclose(made["force"].values, 0.029 * 1.5e5)
    np.testing.assert_allclose(made["position"].values[0], 15.5e-3)


def test_the_tables_are_complete() -> None:
    assert {name for name in mapping_names() if f"`{name}`" not in PAGE} == set()
    assert set(re.findall(r"`([^`]+)`", PAGE.split("| of | units |")[1].split("##")[0])) <= set(UNITS)
