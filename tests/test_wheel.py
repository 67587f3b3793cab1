"""What the package holds: everything that the rooms need at run time, and nothing else."""

from __future__ import annotations

import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parents[1]
ROOMS = ("bristle", "detector", "hil", "identification", "recordings", "simulator")


@pytest.fixture(scope="module")
def names(tmp_path_factory) -> set[str]:
    """The files of a wheel made of this tree."""
    wheel = pytest.importorskip("hatchling.builders.wheel")
    folder = tmp_path_factory.mktemp("dist")
    (made,) = wheel.WheelBuilder(str(HOUSE)).build(directory=str(folder), versions=["standard"])
    with zipfile.ZipFile(made) as archive:
        return set(archive.namelist())


def tracked(*folders: str) -> set[str]:
    """The files of the tree that belong to the project, without those that git ignores."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *folders]
    done = subprocess.run(command, cwd=HOUSE, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip("the tree is no git repository")
    return {name for name in done.stdout.splitlines() if (HOUSE / name).is_file()}


def test_the_wheel_holds_the_rooms_whole_and_nothing_else(names):
    own = {name for name in names if ".dist-info/" not in name}
    assert own == tracked(*ROOMS)


def test_what_is_needed_at_run_time_is_in_it(names):
    for needed in (
        "recordings/library/step.h5", "hil/registers/maps/damadics.toml", "recordings/mappings/emps.toml",
        "simulator/compile/c/loop.c", "simulator/export/templates/model.c", "hil/page/views/templates/page.js",
        "identification/report/templates/page.html", "identification/estimators/noise_aware/pass.c", "bristle/py.typed",
    ):  # fmt: skip
        assert needed in names
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)


def test_neither_tests_nor_studies_nor_papers_are_in_it(names):
    folders = {name.split("/")[0] for name in names if ".dist-info/" not in name}
    assert folders == set(ROOMS)


def test_the_source_package_is_the_whole_tree(tmp_path):
    sdist = pytest.importorskip("hatchling.builders.sdist")
    (made,) = sdist.SdistBuilder(str(HOUSE)).build(directory=str(tmp_path), versions=["standard"])
    with tarfile.open(made) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert names == tracked() | {"PKG-INFO"}
