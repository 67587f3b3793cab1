"""From a foreign file to a recording, by what is said about it."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from pathlib import Path

from recordings.errors import BadInput
from recordings.hdf5.header import RESERVED
from recordings.importers.assemble import Imported, assemble, text_columns
from recordings.importers.clock import first_date, time_column
from recordings.importers.dates import NAMED, guess_format
from recordings.importers.file_format import format_of, is_recording
from recordings.importers.mapping import ImportMapping, with_changes
from recordings.importers.table import ForeignTable


def import_file(path: str | Path, mapping: ImportMapping | None = None) -> Imported:
    """Make a recording of a CSV, TSV, MATLAB, HDF5 or Parquet file.

    Parameters
    ----------
    path : str or Path
        The file; its kind is recognised by its content.
    mapping : ImportMapping, optional
        What its columns are; without one, columns whose header says a known name and a unit are taken.

    Raises
    ------
    BadInput
        The file cannot be read, or the mapping does not fit it; names file, row or column, and what to do.
    """
    path, mapping = Path(path), mapping or ImportMapping()
    table, mapping = _with_dates(path, mapping, _table(path, mapping))
    attributes: dict[str, str | float] = {k: v for k, v in table.constants.items() if k not in RESERVED}
    attributes |= mapping.attributes
    with path.open("rb") as file:
        attributes |= {"imported_from": path.name, "imported_sha256": hashlib.file_digest(file, "sha256").hexdigest()}
    written = datetime.fromtimestamp(int(path.stat().st_mtime), UTC)
    about = {"title": mapping.title or path.name, "source": mapping.source, "attributes": attributes}
    return assemble(table, mapping, created=first_date(table, mapping.time) or written, **about)


def _with_dates(path: Path, mapping: ImportMapping, table: ForeignTable) -> tuple[ForeignTable, ImportMapping]:
    """The table, and the mapping that says how its dates are written, where time is dates and nothing says so.

    Raises BadInput where day and month could be either way round, or the time is neither a date nor a number.
    """
    clock = mapping.time
    if clock.rate_hz is not None or clock.date_format is not None:
        return table, mapping
    try:
        column = time_column(table, clock)
    except BadInput:
        return table, mapping  # said better once the signals are known
    if column is None or column not in table.bad_cells:
        return table, mapping
    forms = guess_format([table.bad_cells[column].text, *table.bad_cells[column].others])
    if len(forms) != 1:
        text = table.bad_cells[column].text[:40]
        found = (
            f"'{text}' in it is {'a date with day or month first' if forms else 'neither a number nor a known date'}"
        )
        remedy = f"say how dates are written: {', '.join(NAMED)}, or a pattern such as %d.%m.%Y %H:%M:%S"
        raise BadInput(f"{table.where}: column '{column}'", found, remedy, parameter="time_format")
    dated = with_changes(mapping, {"time": {"column": column, "format": forms[0]}}, "the times")
    return _table(path, dated), dated


def _table(path: Path, mapping: ImportMapping) -> ForeignTable:
    if is_recording(path):
        raise BadInput(str(path), "it is a recording already", "use it as it is")
    return format_of(path).read(path, mapping.file, text_columns(mapping))


def read_table(path: str | Path, mapping: ImportMapping | None = None) -> ForeignTable:
    """The columns of a foreign file as they stand there, for programs that choose among them. Raises BadInput."""
    return _table(Path(path), mapping or ImportMapping())
