"""The rooms of the house: who may import whom, and what must not be loaded before it is needed."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parents[1]

ARROWS = {
    "recordings": set(),
    "simulator": {"recordings"},
    "identification": {"simulator", "recordings"},
    "detector": {"recordings", "simulator"},
    "hil": {"recordings", "simulator", "identification", "detector"},
    "bristle": {"recordings", "simulator", "identification", "detector", "hil"},
}
"""What each room may import of the others."""

EXCEPTIONS = {("bristle/_app.py", "recordings._errors")}
"""Imports of another room's inner modules that are meant: the command line must start without loading the room."""

HEAVY = {"bokeh", "casadi", "numba", "pymodbus", "pysindy"}

MODULES = sorted(path for room in ARROWS for path in (HOUSE / room).rglob("*.py"))


def imported(source: str) -> Iterator[str]:
    """Full dotted names that a module imports from elsewhere, wherever in it the import stands."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def violations(place: str, source: str) -> list[str]:
    """What a module at a place like ``simulator/_step.py`` imports against the rules, in words."""
    room, found = place.split("/")[0], []
    for name in imported(source):
        other, *inner = name.split(".")
        if other not in ARROWS or other == room:
            continue
        if other not in ARROWS[room]:
            found.append(f"{place} imports {name}; {room} may import {sorted(ARROWS[room]) or 'no other room'}")
        excepted = any(place == where and name.startswith(what) for where, what in EXCEPTIONS)
        if any(part.startswith("_") for part in inner) and not excepted:
            found.append(f"{place} imports {name}, an inner module; import the name from {other}")
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(HOUSE)))
def test_imports_follow_the_arrows_and_leave_inner_modules_alone(path):
    assert violations(str(path.relative_to(HOUSE)), path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("place", "source", "said"),
    [
        ("recordings/_reader.py", "import simulator", "recordings may import no other room"),
        ("simulator/_step.py", "def f():\n    from identification import fit", "simulator may import ['recordings']"),
        ("identification/_fit.py", "from simulator._scan import Scanner", "simulator._scan.Scanner, an inner module"),
        ("identification/_fit.py", "import simulator.damadics._outputs", "an inner module"),
        ("identification/_fit.py", "from simulator import _scan", "an inner module"),
        ("hil/_app.py", "from recordings._errors import BadInput", "an inner module"),
        ("detector/_observer.py", "from hil import serve", "detector may import"),
    ],
)
def test_what_breaks_the_rules_is_seen(place, source, said):
    (found,) = violations(place, source)
    assert said in found


@pytest.mark.parametrize(
    ("place", "source"),
    [
        ("bristle/_app.py", "from recordings._errors import BadInput"),
        ("simulator/_step.py", "from simulator._scan import Scanner"),
        ("simulator/_step.py", "from ._scan import Scanner\nimport casadi"),
        ("hil/_monitor.py", "from simulator.damadics import faults\nimport identification, detector, recordings"),
    ],
)
def test_what_keeps_the_rules_passes(place, source):
    assert violations(place, source) == []


def test_every_room_is_looked_at():
    assert {path.relative_to(HOUSE).parts[0] for path in MODULES} >= {"recordings", "simulator", "bristle"}
    packages = {path.parent.name for path in HOUSE.glob("*/__init__.py")}
    assert packages - {"benchmarks"} <= set(ARROWS)


def loaded_by(program: str) -> set[str]:
    """Top-level modules in a fresh interpreter after a program ran."""
    report = "import sys; print(*{name.partition('.')[0] for name in sys.modules}, file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", f"{program}\n{report}"], cwd=HOUSE, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


@pytest.mark.parametrize(
    ("program", "absent"),
    [
        ("import bristle", HEAVY),
        ("from bristle._app import run; assert run(['--help']) == 0", HEAVY),
        ("import recordings", HEAVY),
        ("import simulator", HEAVY - {"casadi"}),
    ],
    ids=["import bristle", "bristle --help", "import recordings", "import simulator"],
)
def test_what_is_heavy_is_loaded_late(program, absent):
    loaded = loaded_by(program)
    assert "typing" in loaded
    assert loaded & absent == set()
