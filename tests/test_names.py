"""A word has one meaning: no two rooms, and no two doors of a room, define a public class of the same name."""

from __future__ import annotations

import importlib
import inspect
from collections import defaultdict

from test_imports import ARROWS, DOORS


def test_no_public_class_name_is_defined_twice():
    definitions: dict[str, set[str]] = defaultdict(set)
    for door in sorted(DOORS):
        module = importlib.import_module(door)
        for name in getattr(module, "__all__", [name for name in vars(module) if not name.startswith("_")]):
            value = getattr(module, name)
            if inspect.isclass(value) and value.__module__.split(".")[0] in ARROWS:
                definitions[name].add(value.__module__)
    assert {name: places for name, places in definitions.items() if len(places) > 1} == {}
