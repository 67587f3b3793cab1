"""May this file be opened or replaced: is it HDF5, whole, cut off while recording, or still being written?"""

from __future__ import annotations

import os
import re
from pathlib import Path

import h5py

from recordings.atomic_files import check_regular, lock
from recordings.errors import BadInput
from recordings.hdf5.problems import unreadable

SIGNATURE = b"\x89HDF\r\n\x1a\n"
_IMPORT = "import other files into a recording first"
_RECOVER = "merge it first, into a new file by an import, or in place with recordings.recover"


def journal_path(path: Path) -> Path:
    """Where the journal of a recording that is being written lies."""
    return path.with_name(path.name + ".journal")


def open_hdf5(path: Path) -> h5py.File:
    """Open a file for reading, also while a recorder writes it.

    Raises
    ------
    BadInput
        Missing, not a regular file, not readable, empty, not HDF5, truncated, or cut off while recording.
    """
    if not starts_like_hdf5(path):
        raise BadInput(str(path), "it is not an HDF5 file", _IMPORT, parameter="import_to")
    if journal_path(path).exists() and not being_written(path):
        found = "it was cut off while recording; its journal lies beside it"
        raise BadInput(str(path), found, _RECOVER, parameter="import_to")
    try:
        # Locks would keep readers away from a live recording; its writer flushes whole batches.
        return h5py.File(path, "r", locking=False)
    except OSError as error:
        cut = re.search(r"eof = (\d+).*stored_eof = (\d+)", str(error))
        if cut is None:
            raise unreadable(str(path), error) from error
        found = f"it is truncated: {cut[1]} of {cut[2]} bytes are there"
        raise BadInput(str(path), found, "copy it again from its origin") from error


def being_written(path: Path) -> bool:
    """Whether a living process holds the writer's lock on a recording."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        lock(descriptor, shared=True)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def check_vacant(
    path: Path,
    overwrite: bool,
    remedy: str = "choose another name, or allow overwriting",
    *,
    parameter: str | None = None,
) -> None:
    """Refuse to take the place of a recording that is being written, or of any that is there unless told.

    A journal counts as a recording, whose file may be lost; `remedy` and `parameter` are those of the `BadInput`.
    """
    if path.exists() and being_written(path):
        raise BadInput(str(path), "another process is recording into it", "choose another name")
    if not overwrite and path.exists():
        raise BadInput(str(path), "it exists already", remedy, parameter=parameter)
    if not overwrite and journal_path(path).exists():
        found = "the journal of an interrupted run is there"
        raise BadInput(str(journal_path(path)), found, "recover that run, or choose another name")


def starts_like_hdf5(path: Path) -> bool:
    """Whether a file carries the HDF5 signature: at its start, or after a user block of 512, 1024, 2048 ... bytes."""
    check_regular(path)
    with path.open("rb") as file:
        places = [0] + [512 << k for k in range(max(0, (path.stat().st_size // 512).bit_length()))]
        return any(file.seek(place) == place and file.read(len(SIGNATURE)) == SIGNATURE for place in places)
