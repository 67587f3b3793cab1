"""Opening an HDF5 file and taking single items out of it, with words for everything that can be wrong."""

from __future__ import annotations

import fcntl
import math
import os
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.files import check_regular
from recordings.hdf5.problems import unreadable
from recordings.signal import text_problem

SIGNATURE = b"\x89HDF\r\n\x1a\n"
_IMPORT = "turn other files into a recording with 'bristle import'"
_RECOVER = "merge it first, into a new file with 'bristle import {path}' or in place with recordings.recover"
_MOST_COMPRESSED = 1100
"""Deflate cannot shrink data further than about 1:1032; what declares more than this holds no data."""
_SLACK_BYTES = 1 << 20
_LONGEST_TEXT = 1 << 16
NOT_PLAIN = object()
"""Stands for an attribute that is neither one text nor one number, and was not read for that reason."""


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
        raise BadInput(str(path), "it is not an HDF5 file", _IMPORT)
    if journal_path(path).exists() and not being_written(path):
        found = "it was cut off while recording; its journal lies beside it"
        raise BadInput(str(path), found, _RECOVER.format(path=path))
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
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
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


def member(parent: h5py.Group, name: str, kind: type, where: str) -> Any:
    """The dataset or group of a name that is stored in this very file.

    Links into other files are refused: a recording must not make its reader open something else.
    """
    if isinstance(parent.get(name, getlink=True), h5py.ExternalLink):
        raise BadInput(where, "it is a link into another file", "a recording is one file: copy the data into it")
    item = parent[name]
    if item.file.filename != parent.file.filename:  # a soft link can lead to a link into another file
        raise BadInput(where, "it is a link into another file", "a recording is one file: copy the data into it")
    if not isinstance(item, kind):
        wanted = "group" if kind is h5py.Group else "dataset"
        raise BadInput(where, f"it is not a {wanted}", f"{where.rsplit(': ', 1)[-1]} is a {wanted}")
    if isinstance(item, h5py.Dataset) and (item.is_virtual or item.external):
        raise BadInput(where, "its data lies in another file", "a recording is one file: copy the data into it")
    return item


def text_attribute(item: h5py.HLObject, name: str, where: str) -> str | None:
    """The text of an attribute, None when it is not there; `BadInput` when it is something else than text."""
    value = raw_attribute(item, name)
    if value is None or isinstance(value, str):
        return value
    found = f"attribute {name} is {_kind(value)}, not text"
    raise BadInput(where, found, f"store {name} as a string")


def number_attribute(item: h5py.HLObject, name: str, where: str) -> float | int | None:
    """The number in an attribute, None when it is not there; `BadInput` when it is something else than one number."""
    value = raw_attribute(item, name)
    if value is None or (isinstance(value, (int, float)) and not isinstance(value, bool)):
        return value
    raise BadInput(where, f"attribute {name} is {_kind(value)}, not a number", f"store {name} as one number")


def raw_attribute(item: h5py.HLObject, name: str) -> Any:
    """An attribute as a plain Python value: one text or number, None when it is not there, else `NOT_PLAIN`."""
    if name not in item.attrs:
        return None
    low = item.attrs.get_id(name)
    if low.shape not in {(), (1,)} or low.get_storage_size() > _LONGEST_TEXT or not is_plain(low):
        return NOT_PLAIN
    value = item.attrs[name]
    if isinstance(value, np.ndarray):
        value = value.reshape(())[()]  # MATLAB and others store a single value as an array of one
    if isinstance(value, bytes):
        value = value.decode("utf-8")
    if isinstance(value, str) and text_problem(value):
        raise ValueError(f"attribute {name}: {text_problem(value)}")
    return value.item() if isinstance(value, np.generic) else value


def is_plain(low: Any) -> bool:
    """Whether an attribute or dataset holds texts or ordinary numbers.

    HDF5 describes number types bit by bit, and crashes or never returns on a damaged description; so only those types
    that this machine could have written are read.
    """
    stored = low.get_type()
    if isinstance(stored, h5py.h5t.TypeStringID):
        return True
    return low.dtype.kind in "iuf" and h5py.h5t.py_create(low.dtype).equal(stored)


def _kind(value: Any) -> str:
    names = {str: "text", bool: "a truth value", int: "a number", float: "a number"}
    return names.get(type(value), "neither one text nor one number")


def check_column(dataset: h5py.Dataset, where: str) -> None:
    """Refuse a dataset that is not one-dimensional, of a damaged type, or declares more than the file can hold."""
    if not is_plain(dataset.id):
        raise BadInput(where, "its values are neither numbers nor texts", "store integers or floating-point numbers")
    if len(dataset.shape or ()) != 1:
        raise BadInput(where, f"it has the shape {dataset.shape}", "a signal is 1-D, shape (n_samples,)")
    check_size(dataset, where)


def check_size(dataset: h5py.Dataset, where: str) -> None:
    """Refuse a dataset that declares more values than its file can hold, or than fit the memory as float64."""
    n_values = math.prod(dataset.shape or (0,))
    declared, stored = n_values * dataset.dtype.itemsize, dataset.id.get_storage_size()
    if declared > _MOST_COMPRESSED * stored + _SLACK_BYTES and not _is_filled(dataset, n_values):
        found = f"it declares {n_values} samples, but the file holds only {stored} bytes for them"
        raise BadInput(where, found, "the file is damaged or was never filled; write it again")
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if 8 * n_values > memory:
        found = f"its {n_values} samples need {8 * n_values / 1e9:.3g} GB of memory"
        raise BadInput(where, found, f"this machine has {memory / 1e9:.3g} GB; cut the recording into parts")


def _is_filled(dataset: h5py.Dataset, n_values: int) -> bool:
    """Whether every chunk is there: a filter may have found that all values of a chunk are one."""
    return bool(dataset.chunks) and dataset.id.get_num_chunks() * math.prod(dataset.chunks) >= n_values


def numbers_of(dataset: h5py.Dataset) -> Array:
    """All values of a checked numeric dataset as float64, shape (n_samples,), read without a second copy."""
    values = np.empty(dataset.shape, np.float64)
    dataset.read_direct(values)
    values.flags.writeable = False
    return values
