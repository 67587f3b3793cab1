"""The bundled recordings: package data beside this module, one `.h5` file each, opened by name."""

from __future__ import annotations

from pathlib import Path

from recordings.errors import BadInput
from recordings.hdf5.reader import read
from recordings.recording import Recording

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


def bundled(name: str) -> Recording:
    """A bundled recording; `BadInput` listing the names when there is none."""
    return read(bundled_path(name))
