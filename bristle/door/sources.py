"""Recordings, from wherever they come."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from recordings import BadInput, Recording, bundled_names, bundled_path
from recordings import read as read_file

BUNDLED = "bundled:"
"""What a source begins with that names a recording that ships with the toolkit."""

RecordingLike = Recording | str | os.PathLike[str]
"""A recording, its file, or ``bundled:NAME``."""


def read(source: RecordingLike) -> Recording:
    """Read a recording.

    Parameters
    ----------
    source : str or path
        A recording file (.h5), or ``bundled:NAME`` for one that ships with the toolkit: ``bundled:step``,
        ``bundled:sine`` or ``bundled:mixed``. A recording is returned as it is.

    Raises
    ------
    BadInput
        There is no such file, or it is no valid recording. `bristle import` makes recordings of other files.

    >>> import bristle as br
    >>> recording = br.read("bundled:step")
    >>> list(recording), len(recording)
    (['time', 'force', 'position'], 10001)
    >>> recording.si("position").values.max() < recording.plant.stroke_m
    np.True_
    """
    if isinstance(source, Recording):
        return source
    return read_file(file_of(source))


def file_of(source: str | os.PathLike[str]) -> Path:
    """The file that a path or ``bundled:NAME`` means. Raises BadInput when there is no bundled recording of that name.

    >>> file_of("bundled:step").name
    'step.h5'
    """
    path = os.fspath(source)
    if not path.startswith(BUNDLED):
        return Path(path)
    name = path.removeprefix(BUNDLED)
    if name not in bundled_names():
        raise BadInput(path, "there is no such bundled recording", f"there are {', '.join(bundled_names())}")
    return bundled_path(name)


def read_all(sources: RecordingLike | Iterable[RecordingLike]) -> list[Recording]:
    """One recording or several, each as `read` takes it."""
    if isinstance(sources, Recording | str | os.PathLike):
        return [read(sources)]
    return [read(source) for source in sources]
