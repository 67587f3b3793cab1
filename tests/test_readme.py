"""Every command in the README runs, word for word."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from bristle.cli.app import run
from recordings import bundled

ROOT = Path(__file__).resolve().parents[1]


def commands() -> list[list[str]]:
    """The lines that begin with a dollar sign in the console blocks of the README."""
    blocks = re.findall(r"```console\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    return [shlex.split(line[2:]) for block in blocks for line in block.splitlines() if line.startswith("$ ")]


def own_csv(folder: Path) -> None:
    """The CSV file of which the README speaks: time in s, pressure in kPa, stem in mm."""
    example = bundled("mixed")
    area = example.plant.diaphragm_area_m2
    assert area
    pressure, stem = example["force"].values / area / 1e3, 1e3 * example["position"].values
    table = np.column_stack([example.time, pressure, stem])
    np.savetxt(folder / "stem-test.csv", table, fmt="%.9g", delimiter=",", header="time,pressure,stem", comments="")


def test_every_command_of_the_readme(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    own_csv(tmp_path)
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
    ran = 0
    for words in commands():
        if words[0] == "make":
            assert words[1] in targets
            continue
        assert words[0] == "bristle"
        assert run(words[1:]) == 0, f"{shlex.join(words)}: {capsys.readouterr().err}"
        ran += 1
    assert ran >= 6
    assert (tmp_path / "report.html").stat().st_size > 100_000


def test_the_readme_links_to_files_that_are_there() -> None:
    links = re.findall(r"\]\((?!http)([^)#]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    assert [link for link in links if not (ROOT / link).is_file()] == []
