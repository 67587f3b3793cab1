"""Reading Parquet files into a table, when pyarrow is installed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from recordings.arrays import Array
from recordings.column_headers import named_columns
from recordings.errors import BadInput, not_installed
from recordings.importers.file_format import FileFormat, Match
from recordings.importers.mapping import FileLayout
from recordings.importers.table import BadCell, ForeignTable, check_expansion


def read_parquet(path: Path) -> ForeignTable:
    """Read a Parquet file: numbers as they are, dates as seconds since the first row, nulls as missing.

    Raises
    ------
    BadInput
        pyarrow is not installed, or the file is damaged.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise not_installed(str(path), "reading Parquet", "pyarrow", "parquet", "save the file as CSV") from None
    try:
        declared = pq.read_metadata(path)
        check_expansion(path, declared.num_rows * declared.num_columns, declared.num_columns)
        content = pq.read_table(path)
    except BadInput:
        raise
    except (pa.ArrowException, OSError, ValueError) as error:
        found = f"it cannot be read as Parquet ({' '.join(str(error).split())[:120]})"
        raise BadInput(str(path), found, "copy it again from its origin") from error
    names, units = named_columns(content.column_names)
    columns: dict[str, Array] = {}
    bad_cells: dict[str, BadCell] = {}
    for name, column in zip(names, content.columns, strict=True):
        kind = column.type
        if pa.types.is_timestamp(kind):
            columns[name], units[name] = _seconds(column, pa), "s"
        elif pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
            columns[name] = np.array(column.cast(pa.float64(), safe=False).to_numpy())
        else:
            columns[name] = np.empty(0)
            remedy = "only columns of numbers and dates can be used"
            bad_cells[name] = BadCell(1, f"a value of the type {kind}", remedy, parameter=None)
    return ForeignTable(str(path), columns, units, bad_cells=bad_cells)


def _seconds(column: Any, pa: Any) -> Array:
    """Dates as seconds since the first one that is there."""
    stamps = column.cast(pa.timestamp("ns"), safe=False).to_numpy().astype("datetime64[ns]")
    there = stamps[~np.isnat(stamps)]
    first = there[0] if len(there) else np.datetime64(0, "ns")
    return np.where(np.isnat(stamps), np.nan, (stamps - first) / np.timedelta64(1, "s"))


def _match(path: Path, head: bytes) -> Match:
    return Match.CONTENT if head[:4] == b"PAR1" else Match.NO


def _read(path: Path, layout: FileLayout, texts: Sequence[str | int]) -> ForeignTable:
    return read_parquet(path)


PARQUET = FileFormat("Parquet", _match, _read)
