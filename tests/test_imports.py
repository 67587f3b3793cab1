"""The rooms of the house: who may import whom, and what must not be loaded before it is needed."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator, Mapping
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

GUESTS = ("benchmarks", "studies", "tools", "examples")
"""Programs that use the house: they may import every room, by its doors."""

DOORS = {
    *ARROWS,
    "bristle.fleet",
    "recordings.errors",
    "recordings.importers",
    "simulator.backlash",
    "simulator.damadics",
    "simulator.damadics.stimuli",
    "simulator.export",
    "simulator.friction",
    "simulator.hysteresis",
    "identification.estimators",
    "identification.following",
    "identification.loops",
    "identification.population",
    "identification.next_test",
    "identification.report",
    "identification.standard_tests",
    "detector.evaluation",
    "detector.generators",
    "detector.published",
    "detector.theory",
    "hil.testing",
}
"""Modules that others may import from: each room's own, and those of its parts that stand for themselves. The errors
are one of them because the command line must start without loading the room behind them."""

CROWDED = 16
"""Modules in a folder, its door among them, beyond which it wants parts of its own."""

HEAVY = {"bokeh", "casadi", "numba", "pymodbus", "pysindy"}
ARRAYS = {"numpy", "scipy", "h5py", "pydantic"}
"""What everything that works with data needs, and help does not."""

MODULES = sorted(path for room in (*ARROWS, *GUESTS) for path in (HOUSE / room).rglob("*.py"))


def is_module(name: str) -> bool:
    """Whether a dotted name is a module of the house, not something that one of its modules defines."""
    place = HOUSE.joinpath(*name.split("."))
    return place.is_dir() or place.with_suffix(".py").is_file()


def imported(source: str) -> Iterator[str]:
    """Full dotted names of the modules that a module imports from, wherever in it the import stands."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if is_module(name) else str(node.module) for name in inner)


def violations(place: str, source: str) -> list[str]:
    """What a module at a place like ``simulator/valve.py`` imports against the rules, in words."""
    room, found = place.split("/")[0], []
    for name in sorted(set(imported(source))):
        other = name.split(".")[0]
        if other not in ARROWS or other == room:
            continue
        if room in ARROWS and other not in ARROWS[room]:
            found.append(f"{place} imports {name}; {room} may import {sorted(ARROWS[room]) or 'no other room'}")
        if name not in DOORS:
            found.append(f"{place} imports {name}, an inner module; import the name from {other}")
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(HOUSE)))
def test_imports_follow_the_arrows_and_leave_inner_modules_alone(path):
    assert violations(str(path.relative_to(HOUSE)), path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("place", "source", "said"),
    [
        ("recordings/recording.py", "import simulator", "recordings may import no other room"),
        ("simulator/valve.py", "def f():\n    from identification import fit", "simulator may import ['recordings']"),
        ("identification/advice.py", "from simulator.compile.scan import Scanner", "simulator.compile.scan, an inner"),
        ("identification/advice.py", "import simulator.damadics.runs", "an inner module"),
        ("identification/advice.py", "from simulator import excitation", "an inner module"),
        ("hil/monitor/session.py", "from recordings.hdf5 import reader", "an inner module"),
        ("detector/observer/observer.py", "from hil import Server", "detector may import"),
        ("benchmarks/fit.py", "from identification.estimators.fit import Fit", "an inner module"),
        ("studies/plant.py", "from detector.observer.observer import Observer", "an inner module"),
    ],
)
def test_what_breaks_the_rules_is_seen(place, source, said):
    (found,) = violations(place, source)
    assert said in found


@pytest.mark.parametrize(
    ("place", "source"),
    [
        ("bristle/cli/app.py", "from recordings.errors import BadInput"),
        ("simulator/valve.py", "from simulator.compile.scan import Scanner"),
        ("simulator/compile/kernel.py", "from .scan import Scanner\nimport casadi"),
        ("hil/monitor/session.py", "from simulator.damadics import Actuator\nimport identification, detector"),
        ("benchmarks/fit.py", "from identification import fit\nfrom benchmarks.machine import described"),
    ],
)
def test_what_keeps_the_rules_passes(place, source):
    assert violations(place, source) == []


@pytest.mark.parametrize("door", sorted(DOORS))
def test_every_door_is_a_module(door):
    assert is_module(door)


def dotted(path: Path) -> str:
    """The name by which a module of the house is imported."""
    return ".".join(path.relative_to(HOUSE).with_suffix("").parts).removesuffix(".__init__")


def circle(graph: Mapping[str, set[str]]) -> list[str]:
    """Modules that import each other in a circle, the first one again at the end; empty where there is none."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def graph_of(room: str) -> dict[str, set[str]]:
    """Which modules of a room import which, also inside functions, and for types alone: those only hide a circle."""
    texts = {dotted(p): p.read_text("utf-8") for p in MODULES if p.relative_to(HOUSE).parts[0] == room}
    found = {name: set(imported(text)) for name, text in texts.items()}
    return {name: (targets & set(texts)) - {name} for name, targets in found.items()}


@pytest.mark.parametrize("room", ARROWS)
def test_no_modules_of_a_room_import_each_other_in_a_circle(room):
    assert circle(graph_of(room)) == []


def test_late_imports_count():
    text = "import a\nif TYPE_CHECKING:\n    import b\nclass C:\n    def f(self):\n        import c\n"
    assert set(imported(text)) == {"a", "b", "c"}


def test_a_circle_is_seen():
    assert circle({"a": {"b"}, "b": {"c"}, "c": set()}) == []
    assert set(circle({"a": {"b"}, "b": {"c"}, "c": {"b"}})) == {"b", "c"}


def test_every_room_is_looked_at():
    assert {path.relative_to(HOUSE).parts[0] for path in MODULES} >= {*ARROWS, "benchmarks"}
    packages = {path.parent.name for path in HOUSE.glob("*/__init__.py")}
    assert packages <= {*ARROWS, *GUESTS}


def test_no_folder_is_crowded():
    folders = {path.parent for path in MODULES if path.relative_to(HOUSE).parts[0] in ARROWS}
    crowded = {str(one.relative_to(HOUSE)): len(list(one.glob("*.py"))) for one in folders}
    assert {name: count for name, count in crowded.items() if count > CROWDED} == {}


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
        ("import bristle", HEAVY | ARRAYS),
        ("import bristle as br; br.Recording", HEAVY),
        ("import bristle as br; br.Plant, br.BadInput, br.read", HEAVY),
        ("from bristle.cli.app import run; assert run(['--help']) == 0", HEAVY | ARRAYS),
        ("from bristle.cli.app import run; assert run(['--version']) == 0", HEAVY | ARRAYS),
        ("import recordings", HEAVY),
        ("import simulator", HEAVY - {"casadi"}),
    ],
    ids=[
        "import bristle", "br.Recording", "br.read", "bristle --help", "bristle --version", "import recordings",
        "import simulator",
    ],
)  # fmt: skip
def test_what_is_heavy_is_loaded_late(program, absent):
    loaded = loaded_by(program)
    assert "encodings" in loaded
    assert loaded & absent == set()
