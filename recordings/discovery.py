"""What the modules of a folder define: so a thing of a known kind is added by its file alone."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType
from typing import TypeVar

T = TypeVar("T")


def modules_of(package: str) -> Iterator[ModuleType]:
    """The modules of a package by its dotted name and of the packages in it, imported, in the order of their names."""
    paths = importlib.import_module(package).__path__
    for found in sorted(pkgutil.walk_packages(paths, f"{package}."), key=lambda one: one.name):
        yield importlib.import_module(found.name)


def classes_of(package: str, kind: type[T]) -> Iterator[type[T]]:
    """The public classes of a kind that the modules of a package define, in the order of the modules.

    >>> from recordings.errors import BristleError
    >>> [one.__name__ for one in classes_of("recordings.hdf5", BristleError)]
    []
    """
    for module in modules_of(package):
        for name, value in vars(module).items():
            own = isinstance(value, type) and value.__module__ == module.__name__ and not name.startswith("_")
            if own and issubclass(value, kind) and value is not kind:
                yield value


def instances_of(package: str, kind: type[T]) -> Iterator[T]:
    """The public values of a kind that the modules of a package assign, in the order of the modules."""
    for module in modules_of(package):
        yield from (value for name, value in vars(module).items() if isinstance(value, kind) and name.isupper())
