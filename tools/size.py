"""What an installation takes on the disk, and for whom.

    python -m tools.size                 what every installation has
    python -m tools.size fleet tls       and what these extras add

Each package is counted once, with the direct requirement that brings it first. Sizes are those of the files that are
installed in this environment, with and without what no program needs: compiled modules of Python (`__pycache__`), tests
and examples, and headers and libraries to build with.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackagePath, distribution

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PROJECT = "bristle"
TESTS = {"tests", "test", "examples", "sample_data"}
BUILD = {".h", ".hpp", ".a", ".cmake", ".pxd", ".pyx", ".pyi"}
MB = 1e6


@dataclass
class Size:
    """Megabytes of a package, and how many of them are bytecode, tests and examples, and headers to build with."""

    name: str
    brought_by: str
    whole: float = 0.0
    bytecode: float = 0.0
    tests: float = 0.0
    build: float = 0.0

    def add(self, path: PackagePath, size: float) -> None:
        """Count a file."""
        self.whole += size
        if "__pycache__" in path.parts:
            self.bytecode += size
        elif TESTS & set(path.parts):
            self.tests += size
        elif "include" in path.parts or path.suffix in BUILD:
            self.build += size

    @property
    def needed(self) -> float:
        """Without what no program needs."""
        return self.whole - self.bytecode - self.tests - self.build


def size_of(found: Distribution, brought_by: str) -> Size:
    """The size of an installed package."""
    size = Size(found.metadata["Name"], brought_by)
    for path in found.files or ():
        place = found.locate_file(path)
        if place.is_file():  # type: ignore[attr-defined]
            size.add(path, place.stat().st_size / MB)  # type: ignore[attr-defined]
    return size


def requirements(found: Distribution, extras: tuple[str, ...] = ()) -> Iterator[Requirement]:
    """What a package needs here, with some of its extras."""
    for text in found.requires or ():
        one = Requirement(text)
        if one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
            yield one


def sizes(extras: tuple[str, ...] = ()) -> list[Size]:
    """The project and all that it brings, each with the direct requirement that brings it."""
    waiting: list[tuple[str, str, tuple[str, ...]]] = [(PROJECT, "", extras)]
    found: dict[str, Size] = {}
    for name, brought_by, asked in waiting:
        if (key := canonicalize_name(name)) in found:
            continue
        package = distribution(name)
        found[key] = size_of(package, brought_by)
        waiting += [(one.name, brought_by or one.name, tuple(one.extras)) for one in requirements(package, asked)]
    return list(found.values())


def main() -> None:
    """Print a table: each direct requirement with what comes with it, the largest first."""
    extras = tuple(sys.argv[1:])
    found = sizes(extras)
    direct = {name: [one for one in found if one.brought_by == name] for name in {one.brought_by for one in found}}
    print(f"{'brought by':18} {'MB':>6} {'without bytecode, tests, headers':>34}  packages")
    for name, parts in sorted(direct.items(), key=lambda item: -sum(one.whole for one in item[1])):
        names = ", ".join(one.name for one in sorted(parts, key=lambda one: -one.whole))
        whole, needed = sum(one.whole for one in parts), sum(one.needed for one in parts)
        print(f"{name or PROJECT:18} {whole:6.1f} {needed:34.1f}  {names}")
    print(f"{'together':18} {sum(one.whole for one in found):6.1f} {sum(one.needed for one in found):34.1f}")


if __name__ == "__main__":
    main()
