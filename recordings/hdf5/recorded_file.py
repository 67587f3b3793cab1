"""What a file that was cut off while recording still says itself, for a recovery whose journal is damaged."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.hdf5.columns import columns_of
from recordings.hdf5.header import Header
from recordings.hdf5.items import check_column, member, raw_attribute
from recordings.hdf5.journal import Contents
from recordings.hdf5.layout_reader import events_of, header_of
from recordings.hdf5.opening import open_hdf5
from recordings.hdf5.probe import probe
from recordings.hdf5.problems import h5py_errors


class RecordedFile:
    """The HDF5 file of a run, as far as it goes: its columns may differ in length. Made by `recorded_file`.

    mark : the root attribute `journal`, which names the run and whether it was closed; events : as far as they can be
    read.
    """

    def __init__(self, path: Path, file: h5py.File) -> None:
        where = str(path)
        self._header: Header = header_of(file, where)
        self._where = where
        self._layout = columns_of(self._header)
        self._columns = [
            member(
                member(file, one.group, h5py.Group, where), one.name, h5py.Dataset, f"{where}: /{one.group}/{one.name}"
            )
            for one in self._layout
        ]
        for column in self._columns:
            check_column(column, where)
        self.mark = str(raw_attribute(file, "journal"))
        self.events = events_of(file, where)

    def __len__(self) -> int:
        """The rows that every column has."""
        return min(len(column) for column in self._columns)

    def contents(self) -> Contents:
        """What its journal would say of it: everything but where the chunks are."""
        chunks = self._columns[0].chunks
        return Contents(
            self.mark.rpartition(" ")[2], chunks[0] if chunks else 4096, self._header, list(self.events), damaged=True
        )

    def rows(self, first: int, end: int) -> Array | None:
        """The values of some rows, shape (n_columns, n_rows); None when it does not have them all."""
        if not first <= end <= len(self):
            return None
        try:
            with h5py_errors(self._where):
                parts = zip(self._layout, self._columns, strict=True)
                return np.stack([one.plain(column[first:end]) for one, column in parts])
        except BadInput:
            return None

    def same(self, first: int, values: Array) -> bool:
        """Whether rows from `first` on hold these values, shape (n_columns, n_rows)."""
        own = self.rows(first, first + values.shape[1])
        return own is not None and np.array_equal(own, values, equal_nan=True)


@contextmanager
def recorded_file(path: Path) -> Iterator[RecordedFile | None]:
    """The file of a run, open as long as the block lasts; None where it cannot be read."""
    file: h5py.File | None = None
    found: RecordedFile | None = None
    try:
        probe(path, lambda: _try(path))
        file = open_hdf5(path)
        with h5py_errors(str(path)):
            found = RecordedFile(path, file)
    except BadInput:
        pass  # a damaged file is what the journal is for
    try:
        yield found
    finally:
        if file is not None:
            file.close()


def _try(path: Path) -> None:
    """Everything that a recovery may read, in a child process."""
    with open_hdf5(path) as file:
        one = RecordedFile(path, file)
        one.rows(0, len(one))
