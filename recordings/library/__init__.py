"""The bundled recordings: package data beside this module, one `.h5` file each, opened by name."""

from __future__ import annotations

import os
from pathlib import Path

from recordings.errors import BadInput
from recordings.hdf5.reader import read
from recordings.recording import Recording

BUNDLED = "bundled:"
"""What the name of a file begins with that means one of these."""

_FOLDER = Path(__file__).parent


def bundled_names() -> tuple[str, ...]:
    """The names of the bundled recordings, sorted."""
    return tuple(sorted(file.stem for file in _FOLDER.glob("*.h5")))


def bundled_path(name: str) -> Path:
    """The file of a bundled recording; `BadInput` listing the names when there is none."""
    if name not in bundled_names():
        there = ", ".join(bundled_names()) or "none is installed"
        raise BadInput(name, "there is no bundled recording of that name", f"names there: {there}")
    return _FOLDER / f"{name}.h5"


def file_of(source: str | os.PathLike[str], folder: Path | None = None) -> Path:
    """The file that a path or ``bundled:NAME`` means. Raises BadInput when there is no bundled recording of that name.

    folder : where a relative path begins, the working directory when None.

    >>> file_of("bundled:step").name
    'step.h5'
    """
    path = os.fspath(source)
    if not path.startswith(BUNDLED):
        return Path(path) if folder is None else folder / path
    name = path.removeprefix(BUNDLED)
    if name not in bundled_names():
        raise BadInput(path, "there is no such bundled recording", f"there are {', '.join(bundled_names())}")
    return bundled_path(name)


def bundled(name: str) -> Recording:
    """A bundled recording; `BadInput` listing the names when there is none."""
    return read(bundled_path(name))
