"""A recording as a file of another program, with all of it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from recordings.exchange.matlab import write_matlab_table
from recordings.exchange.parquet import write_parquet_table
from recordings.exchange.table_form import RecordedParts, table_of

WRITERS = {"matlab": write_matlab_table, "parquet": write_parquet_table}


def write_table(path: Path, recording: RecordedParts, form: Literal["matlab", "parquet"]) -> None:
    """Write a recording as a Parquet or MATLAB file of which `import_to` makes the same recording, whole or not at all.

    Raises BadInput where pyarrow is not installed, and when the disk refuses.
    """
    WRITERS[form](path, table_of(recording))
