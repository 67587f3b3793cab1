"""Single datasets, groups and attributes taken out of an HDF5 file, with words for all that can be wrong with them."""

from __future__ import annotations

import math
import os
from typing import Any

import h5py
import numpy as np

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.sample_checks import TIME_REMEDY, time_fault
from recordings.signal import text_problem

_MOST_COMPRESSED = 1100
"""Deflate cannot shrink data further than about 1:1032; what declares more than this holds no data."""
_COPY_IN = "a recording is one file: copy the data into it"
_SLACK_BYTES = 1 << 20
_LONGEST_TEXT = 1 << 16
CLOCK_ROWS = 1 << 18
NOT_PLAIN = object()
"""Stands for an attribute that is neither one text nor one number, and was not read for that reason."""


def own_item(parent: h5py.Group, name: str, where: str) -> Any:
    """The item of a name that is stored in this very file.

    Links into other files are refused: a file must not make its reader open something else.
    """
    if isinstance(parent.get(name, getlink=True), h5py.ExternalLink):
        raise BadInput(where, "it is a link into another file", _COPY_IN)
    item = parent[name]
    if item.file.filename != parent.file.filename:  # a soft link can lead to a link into another file
        raise BadInput(where, "it is a link into another file", _COPY_IN)
    if isinstance(item, h5py.Dataset) and (item.is_virtual or item.external):
        raise BadInput(where, "its data lies in another file", _COPY_IN)
    return item


def member(parent: h5py.Group, name: str, kind: type, where: str) -> Any:
    """The dataset or group of a name that is stored in this very file."""
    item = own_item(parent, name, where)
    if not isinstance(item, kind):
        wanted = "group" if kind is h5py.Group else "dataset"
        raise BadInput(where, f"it is not a {wanted}", f"{where.rsplit(': ', 1)[-1]} is a {wanted}")
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


def clock_of(dataset: h5py.Dataset, where: str) -> Array:
    """The same of a clock, as far as it goes forward: a small file may declare any number of samples, but what fills
    the memory does not go forward. Raises `BadInput` at the first sample that does not.
    """
    values, before = np.empty(dataset.shape, np.float64), -np.inf  # takes no memory before it is filled
    for start in range(0, len(values), CLOCK_ROWS):
        block = np.s_[start : start + CLOCK_ROWS]
        dataset.read_direct(values, block, block)
        if time_fault(values[block], before):
            _, found = time_fault(values[: block.stop]) or (0, "")
            raise BadInput(where, found, TIME_REMEDY)
        before = float(values[block][-1])
    values.flags.writeable = False
    return values


def numbers_of(dataset: h5py.Dataset) -> Array:
    """All values of a checked numeric dataset as float64, shape (n_samples,), read without a second copy."""
    values = np.empty(dataset.shape, np.float64)
    dataset.read_direct(values)
    values.flags.writeable = False
    return values
