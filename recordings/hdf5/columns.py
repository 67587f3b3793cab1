"""The columns of a recording: its signals, and in version 2 the quality and the reply time of each of their values.

Arrays of a writer or a recovery hold one row a column, as float64; a file holds each column in a type of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from recordings.arrays import Array
from recordings.hdf5.header import Header
from recordings.sample_checks import NOT_KNOWN

ColumnGroup = Literal["signals", "quality", "reply_times"]


@dataclass(frozen=True)
class StoredColumn:
    """One column. group, name : where it lies in the file."""

    group: ColumnGroup
    name: str

    @property
    def label(self) -> str:
        """What to call it in a message."""
        return self.name if self.group == "signals" else f"{self.group} of {self.name}"

    @property
    def dtype(self) -> np.dtype[np.float64] | np.dtype[np.uint8]:
        """The type in the file."""
        return np.dtype("u1") if self.group == "quality" else np.dtype("<f8")

    def stored(self, values: Array) -> NDArray[np.float64] | NDArray[np.uint8]:
        """Values, shape (n_rows,), as the file holds them."""
        if self.group == "quality":
            return np.nan_to_num(values, nan=NOT_KNOWN).astype(np.uint8)
        return cast("Array", values.astype("<f8"))

    def plain(self, stored: NDArray[np.generic]) -> Array:
        """The reverse: as float64, NaN where nothing is known."""
        values = stored.astype(np.float64)
        if self.group == "quality":
            values[values == NOT_KNOWN] = np.nan
        return values

    def from_bytes(self, data: bytes) -> Array:
        """Values of the bytes of a chunk, which is not compressed."""
        return self.plain(np.frombuffer(data, self.dtype))


def columns_of(header: Header) -> tuple[StoredColumn, ...]:
    """The columns in the order of a writer and its journal: the signals, then the quality and the times of all but the
    clock.
    """
    names = [spec.name for spec in header.signals]
    about = [name for name in names if name != "time"] if header.per_value else []
    return (
        *(StoredColumn("signals", name) for name in names),
        *(StoredColumn("quality", name) for name in about),
        *(StoredColumn("reply_times", name) for name in about),
    )
