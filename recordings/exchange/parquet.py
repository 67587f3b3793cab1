"""Parquet files that hold all of a recording, the text about it in the metadata of the schema."""

from __future__ import annotations

from pathlib import Path

from recordings.atomic_files import appearing
from recordings.errors import not_installed
from recordings.exchange.data_frames import ABOUT
from recordings.exchange.table_form import WholeTable


def write_parquet_table(path: Path, table: WholeTable) -> None:
    """Write a table, whole or not at all. Raises BadInput without pyarrow, and when the disk refuses."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise not_installed(str(path), "writing Parquet", "pyarrow", "parquet", "write a MATLAB file") from None
    content = pa.table(dict(table.columns)).replace_schema_metadata({ABOUT: table.about})
    with appearing(path) as draft:
        pq.write_table(content, draft)
