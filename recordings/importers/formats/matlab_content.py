"""What scipy reads of a MATLAB file, read by a child process alone.

On some damaged files scipy's reader follows an index that is out of range. It may crash; it may also go on and leave a
broken heap behind, so that a child which came to its end does not say that a second reading is safe. So the child hands
over what it read, and this process reads none of the file.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from recordings.hdf5.probe import probe

MatlabReading = Callable[[], Mapping[str, NDArray[Any]]]
"""Reads arrays of numbers or texts by name."""


def content_of(path: Path, reading: MatlabReading) -> dict[str, NDArray[Any]]:
    """What a reading of a file through scipy finds, by name; without a child process on systems that cannot have one.

    Raises
    ------
    BadInput
        scipy crashes on the file, or takes too long or too much memory.
    ValueError
        With the words of what the reading raised, whatever a damaged byte led to.
    """
    with tempfile.TemporaryFile() as told:
        if not probe(path, lambda: _tell(reading, told), "scipy"):
            return dict(reading())
        told.seek(0)
        failure, *names = np.load(told, allow_pickle=False).tolist()
        if failure:
            raise ValueError(failure)
        return {name: np.load(told, allow_pickle=False) for name in names}


def _tell(reading: MatlabReading, told: IO[bytes]) -> None:
    """Write what is read, or why it cannot be: first the words of a failure and all names, then array by array."""
    failure, content = "", dict[str, NDArray[Any]]()
    try:
        content.update(reading())
    except Exception as error:  # scipy raises whatever a damaged byte leads to
        failure = str(error) or type(error).__name__
    for item in (np.array([failure, *content]), *content.values()):
        np.save(told, item, allow_pickle=False)
    told.flush()
