"""Writing a whole recording at once, and the simulator's truth beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from recordings.arrays import Array
from recordings.atomic_files import appearing
from recordings.errors import BadInput
from recordings.hdf5.columns import StoredColumn, columns_of
from recordings.hdf5.disk import new_hdf5
from recordings.hdf5.items import member, raw_attribute
from recordings.hdf5.layout_writer import append_events, create_column, create_events, write_header
from recordings.hdf5.opening import check_vacant, journal_path, open_hdf5
from recordings.hdf5.problems import h5py_errors
from recordings.recording import Recording
from recordings.signal import text_problem

Truth = Mapping[str, "float | str | Array"]
"""What a simulated recording hides: numbers, words, and signals without noise (n_samples,), by name."""

_CHUNK_ROWS = 16384
"""128 KiB of float64: deflate works well and a reader needs little memory beside the values."""


def write(path: str | Path, recording: Recording, truth: Truth | None = None, *, overwrite: bool = True) -> None:
    """Write a recording to a file, whole or not at all: a reader sees the old file or the new one.

    Parameters
    ----------
    path : str or Path
        Where to; by default a file there is replaced.
    recording : Recording
        What to write.
    truth : mapping, optional
        What a simulator knows, stored under `/truth`: numbers and texts as attributes, arrays as datasets.
    overwrite : bool
        Whether a file that exists may be replaced.

    Raises
    ------
    BadInput
        The file exists and may not be replaced, the disk refused, or a truth cannot be stored.

    >>> import tempfile
    >>> from recordings import bundled, read
    >>> path = f"{tempfile.mkdtemp()}/step.h5"
    >>> write(path, bundled("step"))
    >>> len(read(path)) == len(bundled("step"))
    True
    """
    path = Path(path)
    check_vacant(path, overwrite)
    _check_truth(truth or {}, path)
    with appearing(path) as draft:
        with new_hdf5(draft) as file:
            _fill(file, recording, truth)
        journal_path(path).unlink(missing_ok=True)  # of the recording that is replaced


def _fill(file: h5py.File, recording: Recording, truth: Truth | None) -> None:
    write_header(file, recording.header)
    chunks = (min(len(recording), _CHUNK_ROWS),)
    for column in columns_of(recording.header):
        storage = {"data": column.stored(_values(recording, column)), "chunks": chunks}
        create_column(file, recording.header, column, **storage, shuffle=True, compression="gzip")
    if recording.events:
        create_events(file)
        append_events(file, recording.events)
    if truth is not None:
        _write_truth(file.create_group("truth", track_order=True), truth)


def _values(recording: Recording, column: StoredColumn) -> Array:
    if column.group == "signals":
        return recording.signals[column.name].values
    found = recording.quality if column.group == "quality" else recording.reply_times
    return np.asarray(found[column.name], np.float64)


def read_truth(path: str | Path) -> dict[str, float | str | Array]:
    """What the simulator stored under `/truth`, for tests and plots; empty when there is nothing.

    Nothing that fits, traces or detects may call it.

    Raises
    ------
    BadInput
        The file cannot be opened or is damaged there.
    """
    where = f"{path}: /truth"
    with open_hdf5(Path(path)) as file, h5py_errors(where):
        if "truth" not in file:
            return {}
        group = member(file, "truth", h5py.Group, where)
        attributes = {name: raw_attribute(group, name) for name in group.attrs}
        return attributes | {name: member(group, name, h5py.Dataset, where)[()] for name in group}


def _check_truth(truth: Truth, path: Path) -> None:
    for name, value in truth.items():
        wrong = text_problem(name) or (text_problem(value) if isinstance(value, str) else None)
        if wrong or not name or "/" in name or name in {".", ".."}:
            found = wrong or f"'{name}' cannot be a name there"
            raise BadInput(f"{path}: /truth", found, "a name is not empty and holds no '/'")


def _write_truth(group: h5py.Group, truth: Truth) -> None:
    for name, value in truth.items():
        if isinstance(value, str) or np.ndim(value) == 0:
            group.attrs[name] = value
        else:
            group.create_dataset(name, data=np.asarray(value, np.float64))
