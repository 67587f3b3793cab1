"""Files that `bristle export` made of recordings, which say all about themselves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from recordings.errors import BadInput
from recordings.exchange import ABOUT, COLUMNS, REMEDY, WholeTable
from recordings.importers.formats.matlab_content import content_of
from recordings.importers.formats.matlab_size import check_unpacked
from recordings.importers.table import check_expansion


def read_exported(path: Path) -> WholeTable | None:
    """The columns of an exported recording and what is said about them; None for any other file."""
    if not path.is_file():
        return None
    with path.open("rb") as file:
        head = file.read(6)
    return _read_parquet(path) if head[:4] == b"PAR1" else _read_matlab(path) if head == b"MATLAB" else None


def _read_parquet(path: Path) -> WholeTable | None:
    """The table of a file that `write_parquet_table` wrote; None for any other file, or without pyarrow."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        return None
    try:
        about = (pq.read_schema(path).metadata or {}).get(ABOUT.encode())
        if about is None:
            return None
        declared = pq.read_metadata(path)
        check_expansion(path, declared.num_rows * declared.num_columns, declared.num_columns)
        content: Any = pq.read_table(path)
    except BadInput:
        raise
    except (pa.ArrowException, OSError, ValueError):
        return None  # the importer of foreign files says what is wrong with it
    columns = {name: content.column(name).to_numpy() for name in content.column_names}
    return WholeTable(columns, about.decode("utf-8", "replace"))


def _read_matlab(path: Path) -> WholeTable | None:
    """The table of a file that `write_matlab_table` wrote; None for any other file."""
    from scipy.io import loadmat, whosmat

    def reading() -> dict[str, Any]:
        if not {ABOUT, COLUMNS} <= {name for name, *_ in whosmat(path)}:
            return {}
        content = loadmat(path, squeeze_me=False, chars_as_strings=True)
        return {name: value for name, value in content.items() if np.asarray(value).dtype.kind in "biufU"}

    check_unpacked(path)
    try:
        content = content_of(path, reading)
    except BadInput:
        raise
    except Exception:  # the importer of foreign files says what is wrong
        return None
    if not content:
        return None
    try:
        columns = json.loads(_text(content[COLUMNS]))
        found = {str(columns[name]): np.ravel(content[name]) for name in columns}
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise BadInput(f"{path}: {COLUMNS}", "it does not say which variable is which", REMEDY) from error
    return WholeTable(found, _text(content[ABOUT]))


def _text(value: Any) -> str:
    return str(np.ravel(value)[0])
