"""Writing the layout of a recording into an open HDF5 file; `layout_reader` reads it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from recordings.hdf5.columns import StoredColumn, columns_of
from recordings.hdf5.header import Header
from recordings.hdf5.layout_reader import FORMAT
from recordings.plant import Event
from recordings.sample_checks import NOT_KNOWN, QUALITIES
from recordings.signal import SignalSpec

_TEXT = h5py.string_dtype()
_EVENT_COLUMNS = {"time": np.dtype("<f8"), "kind": _TEXT, "text": _TEXT}


def write_header(file: h5py.File, header: Header) -> None:
    """Store everything but samples and events, and make the groups of the columns."""
    about = {"title": header.title, "source": header.source}
    about["created"] = header.created.isoformat() if header.created else None
    version = 2 if header.per_value else 1
    _set(file, {"format": FORMAT, "version": version} | about | dict(header.attributes))
    file.create_group("signals", track_order=True)
    if header.per_value:
        codes = ", ".join(f"{code} {word}" for code, word in enumerate(QUALITIES))
        file.create_group("quality", track_order=True).attrs["codes"] = f"{codes}, {NOT_KNOWN} not known"
        file.create_group("reply_times", track_order=True).attrs["unit"] = "s"
    known = header.plant.known()
    if known:
        _set(file.create_group("plant", track_order=True), known)


def create_signal(file: h5py.File, spec: SignalSpec, **storage: Any) -> h5py.Dataset:
    """Make the dataset of a signal; `storage` says how h5py stores it. What is never written reads as missing."""
    dataset = file["signals"].create_dataset(spec.name, dtype="<f8", fillvalue=np.nan, **storage)
    _set(dataset, {item.name: getattr(spec, item.name) for item in fields(SignalSpec) if item.name != "name"})
    return dataset


def create_columns(file: h5py.File, header: Header, **storage: Any) -> list[h5py.Dataset]:
    """Make the datasets of all columns, empty, in the order of `columns_of`."""
    return [create_column(file, header, column, **storage) for column in columns_of(header)]


def create_column(file: h5py.File, header: Header, column: StoredColumn, **storage: Any) -> h5py.Dataset:
    """Make the dataset of one column."""
    if column.group == "signals":
        spec = next(spec for spec in header.signals if spec.name == column.name)
        return create_signal(file, spec, **storage)
    missing = NOT_KNOWN if column.group == "quality" else np.nan
    return file[column.group].create_dataset(column.name, dtype=column.dtype, fillvalue=missing, **storage)


def create_events(file: h5py.File, chunk_rows: int = 64) -> None:
    """Make the three columns of the events, empty."""
    group = file.create_group("events", track_order=True)
    for name, dtype in _EVENT_COLUMNS.items():
        group.create_dataset(name, (0,), maxshape=(None,), chunks=(chunk_rows,), dtype=dtype)


def append_events(file: h5py.File, events: Iterable[Event]) -> None:
    """Add events behind those already there."""
    rows = list(events)
    for name in _EVENT_COLUMNS if rows else ():
        column = file["events"][name]
        column.resize(len(column) + len(rows), axis=0)
        column[-len(rows) :] = [getattr(row, name) for row in rows]


def append_samples(dataset: h5py.Dataset, values: NDArray[Any]) -> None:
    """Add values, shape (n_samples,), behind those already there."""
    start = len(dataset)
    dataset.resize(start + len(values), axis=0)
    dataset[start:] = values


def _set(item: h5py.HLObject, values: Mapping[str, Any]) -> None:
    for name, value in values.items():
        if value is not None:
            item.attrs[name] = value
