"""A look into a foreign file before it is imported: what its columns are, what is still open, what to type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.importers.assemble import recognised_columns
from recordings.importers.clock import time_column
from recordings.importers.dates import NAMED, guess_format
from recordings.importers.formats.text_dialect import number_like
from recordings.importers.mapping import ImportMapping, with_changes
from recordings.importers.reading import import_file, read_table
from recordings.importers.table import ForeignTable
from recordings.sample_checks import holds_number
from recordings.signal import UNDERSTOOD

Guesses: TypeAlias = tuple[tuple[str, str], ...]
"""Names of parameters with their values."""

_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"), (1e8, "s"))
"""From which size on a time counts from 1970 in which unit."""
_OPEN = ("UNIT", "UNIT_HZ")
"""How a guess ends that wants a unit to be said."""


@dataclass(frozen=True)
class PreviewedColumn:
    """One column. unit : by its header, None where that says none; holds : numbers, dates, text or nothing; low, high :
    of numbers; example : its first text; becomes : the signal's name, ``left out``, or what has to be said.
    """

    name: str
    unit: str | None
    holds: str
    low: float | None
    high: float | None
    example: str
    becomes: str


@dataclass(frozen=True)
class ImportPreview:
    """What a file holds. options : what `import_file` has to be told of it, as far as that can be guessed, each
    as the name of a parameter and its value;
    notes : sentences on what was guessed, left out or looks wrong; missing : what has to be said, None for nothing.
    """

    file: Path
    rows: int
    columns: tuple[PreviewedColumn, ...]
    options: Guesses
    notes: tuple[str, ...]
    missing: str | None


def preview(path: str | Path, mapping: ImportMapping | None = None) -> ImportPreview:
    """Look into a file. mapping : what is known of it already.

    Raises BadInput where the file cannot be read at all.
    """
    path, mapping = Path(path), mapping or ImportMapping()
    table, mapping, options = with_decimal_sign(path, mapping, read_table(path, mapping))
    mapping, clock_options, notes = _clock(table, mapping)
    options += clock_options
    signals, signal_options = _signals(table, mapping)
    options += signal_options
    unsaid = next((value for _, value in options if value.endswith(_OPEN)), None)
    missing = None if unsaid is None else f"'{unsaid}' stands for what you have to say"
    if missing is None:
        try:
            notes += import_file(path, mapping).notes
        except BadInput as problem:
            missing = str(problem)
    if missing is not None:
        notes = (*table.notes, *notes)
    columns = tuple(_column(table, name, mapping, signals) for name in table.columns)
    n_rows = max((len(values) for values in table.columns.values()), default=0)
    return ImportPreview(path, n_rows, columns, options, notes, missing)


def with_decimal_sign(
    path: Path, mapping: ImportMapping, table: ForeignTable
) -> tuple[ForeignTable, ImportMapping, Guesses]:
    """The table with the decimal sign under which more columns are numbers."""
    commas = [name for name, bad in table.bad_cells.items() if "," in bad.text and number_like(bad.text)]
    if mapping.file.decimal != "." or not commas:
        return table, mapping, ()
    try:
        changed = with_changes(mapping, {"file": {"decimal": ","}}, "options")
        other = read_table(path, changed)
    except BadInput:
        return table, mapping, ()
    better = len(other.bad_cells) < len(table.bad_cells)
    return (other, changed, (("decimal", ","),)) if better else (table, mapping, ())


def _clock(table: ForeignTable, mapping: ImportMapping) -> tuple[ImportMapping, Guesses, tuple[str, ...]]:
    """What the time is: the mapping with it, the options that say so, and a note."""
    clock = mapping.time
    if clock.rate_hz is not None:
        return mapping, (), (f"time: {clock.rate_hz:g} rows a second",)
    try:
        column = time_column(table, clock)
    except BadInput:
        return mapping, (("rate_hz", "UNIT_HZ"),), ("time: no column is known to hold it; name one, or give a rate",)
    if column is None or clock.date_format is not None:
        return mapping, (), ()
    if column in table.bad_cells:
        return _dated(table, mapping, column)
    symbol = clock.unit or table.units.get(column)
    if symbol is not None:
        return mapping, (), (f"time: column '{column}' in {symbol}",)
    guess = _epoch(table.columns[column])
    if guess is None:
        return mapping, (("time", f"{column}:UNIT"),), (f"time: column '{column}', whose unit has to be said",)
    changed = with_changes(mapping, {"time": {"column": column, "unit": guess}}, "options")
    return changed, (("time", f"{column}:{guess}"),), (f"time: column '{column}' counts {guess} since 1970",)


def _dated(table: ForeignTable, mapping: ImportMapping, column: str) -> tuple[ImportMapping, Guesses, tuple[str, ...]]:
    bad = table.bad_cells[column]
    forms = guess_format([bad.text, *bad.others])
    if not forms:
        words = f"time: '{bad.text[:40]}' in column '{column}' is in no known format; say which it is"
        return mapping, (("time", column), ("time_format", "UNIT")), (words,)
    changed = with_changes(mapping, {"time": {"column": column, "format": forms[0]}}, "options")
    words = f"time: column '{column}' holds dates, {forms[0]}, such as {bad.text[:40]}"
    if len(forms) > 1:
        words += f"; day and month could be the other way round: {', '.join(NAMED[1:])}"
    return changed, (("time", column), ("time_format", forms[0])), (words,)


def _epoch(values: Array) -> str | None:
    there = values[np.isfinite(values)]
    return next((symbol for least, symbol in _EPOCHS if len(there) and there[0] > least), None)


def _signals(table: ForeignTable, mapping: ImportMapping) -> tuple[dict[str, str], Guesses]:
    """Signal by column, and the options for those whose header says a name, but no unit."""
    named = {column: name for name, one in mapping.signals.items() if (column := table.find(str(one.column)))}
    own = {name: name.casefold() for name in table.columns if name.casefold() in UNDERSTOOD}
    signals = named | {
        k: v for k, v in (own | recognised_columns(table, set(named.values()))).items() if k not in named
    }
    signals = {column: name for column, name in signals.items() if name != "time"}
    wanted = [
        f"{name}={column}:UNIT"
        for column, name in signals.items()
        if column not in named and column not in table.units and column not in table.bad_cells
    ]
    return signals, tuple(("column", want) for want in wanted)


def _column(table: ForeignTable, name: str, mapping: ImportMapping, signals: Mapping[str, str]) -> PreviewedColumn:
    bad, values = table.bad_cells.get(name), table.columns[name]
    unit = table.units.get(name)
    clock = _is_clock(table, name, mapping)
    if bad is not None:
        dates = bool(guess_format([bad.text, *bad.others]))
        becomes = "time" if clock and dates else signals.get(name, "left out")
        return PreviewedColumn(name, unit, "dates" if dates else "text", None, None, bad.text[:40], becomes)
    if not holds_number(values):
        return PreviewedColumn(name, unit, "nothing", None, None, "", "left out")
    there = values[np.isfinite(values)]
    becomes = "time" if clock else signals.get(name) or ("extra" if unit else "left out: no unit")
    return PreviewedColumn(name, unit, "numbers", float(there.min()), float(there.max()), "", becomes)


def _is_clock(table: ForeignTable, name: str, mapping: ImportMapping) -> bool:
    try:
        return time_column(table, mapping.time) == name
    except BadInput:
        return False


def as_json(found: ImportPreview) -> dict[str, Any]:
    """A preview as JSON has it."""
    columns = [
        {
            "name": one.name, "unit": one.unit, "holds": one.holds, "from": one.low, "to": one.high,
            "example": one.example, "becomes": one.becomes,
        }
        for one in found.columns
    ]  # fmt: skip
    return {
        "format": "import-preview", "version": 1, "file": str(found.file), "rows": found.rows, "columns": columns,
        "options": list(found.options), "notes": list(found.notes), "missing": found.missing,
    }  # fmt: skip
