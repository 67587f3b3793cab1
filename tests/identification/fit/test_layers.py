"""The parts of the identification build on one another in one direction."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import identification

ROOM = Path(identification.__file__).parent
LAYERS = ("data", "estimators", "uncertainty", "tracing", "report")
"""Each may import from those before it."""
SHARED = {"parallel", "budget"}
"""Modules of the room itself that every layer may import from."""


def parts_imported(path: Path) -> set[str]:
    """The parts of the room, and modules beside them, that a module imports from when it is loaded.

    A result reaches for its report only when it is asked for one, inside the method.
    """
    body = ast.parse(path.read_text(encoding="utf-8")).body
    names = [node.module for node in body if isinstance(node, ast.ImportFrom) and node.module]
    return {name.split(".")[1] for name in names if name.startswith("identification.")}


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_imports_from_those_before_it(layer: str):
    later = set(LAYERS[LAYERS.index(layer) + 1 :])
    modules = sorted((ROOM / layer).rglob("*.py"))
    assert modules
    assert {str(path.relative_to(ROOM)): parts_imported(path) & later for path in modules} == {
        str(path.relative_to(ROOM)): set() for path in modules
    }


@pytest.mark.parametrize("layer", LAYERS[:3])
def test_what_is_below_a_fitted_model_knows_nothing_of_its_file_and_report(layer: str):
    beside = set.union(*(parts_imported(path) for path in (ROOM / layer).rglob("*.py"))) - set(LAYERS)
    assert beside <= SHARED
