"""Recordings, from wherever they come."""

from __future__ import annotations

import os
from collections.abc import Iterable

from recordings import Recording, file_of
from recordings import read as read_file

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


def read_all(sources: RecordingLike | Iterable[RecordingLike]) -> list[Recording]:
    """One recording or several, each as `read` takes it."""
    if isinstance(sources, Recording | str | os.PathLike):
        return [read(sources)]
    return [read(source) for source in sources]
