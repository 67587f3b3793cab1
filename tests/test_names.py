"""A word has one meaning: no two modules of the house define a public class or a type of the same name."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest
from test_imports import ARROWS, HOUSE, MODULES

SHARED: dict[str, str] = {}
"""Names that two rooms may give to two things, each with the reason: the word is the field's own in both."""


def types_of(source: str) -> Iterator[str]:
    """Names of a module's public classes and type aliases: assigned once, in capitals as classes are."""
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef):
            name = node.name
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            name = node.targets[0].id
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            name = node.target.id
        else:
            continue
        if name[0].isupper() and not name.isupper():
            yield name


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("class Watch:\n    Inner = int\nclass _Own: pass", ["Watch"]),
        ("Form = Literal['play', 'lugre']\nRun: TypeAlias = int", ["Form", "Run"]),
        ("FORMS = ('play', 'lugre')\nT = TypeVar('T')\nlimit, Number = 3, 4\n_Own = int", []),
        ("from recordings import Recording\ndef f():\n    Local = int", []),
    ],
)
def test_types_are_told_from_other_names(source, names):
    assert list(types_of(source)) == names


def test_no_name_of_a_type_is_defined_twice():
    places: dict[str, set[Path]] = defaultdict(set)
    for path in MODULES:
        place = path.relative_to(HOUSE)
        if place.parts[0] in ARROWS:
            for name in types_of(path.read_text(encoding="utf-8")):
                places[name].add(place)
    twice = {name: sorted(map(str, found)) for name, found in places.items() if len(found) > 1}
    assert {name: found for name, found in twice.items() if name not in SHARED} == {}
    assert set(SHARED) <= set(twice), "an exception that is not needed any more"
