"""Reading the sheets of Excel files into a table, when openpyxl is installed."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from recordings.arrays import Array
from recordings.column_headers import named_columns
from recordings.errors import BadInput, not_installed
from recordings.importers.file_format import FileFormat, Match
from recordings.importers.formats.text_dialect import looks_like_names, looks_like_units
from recordings.importers.mapping import FileLayout
from recordings.importers.table import BadCell, ForeignTable

LARGEST = 500_000_000
"""Bytes that the parts of a file may unpack to."""
_SAMPLE_ROWS = 30
_WORKBOOK = "xl/workbook.xml"

SheetRow = tuple[int, Sequence[Any]]


def read_excel(path: Path, layout: FileLayout, texts: Sequence[str | int] = ()) -> ForeignTable:
    """Read one sheet of an Excel file (.xlsx): the one that `layout.variable` names, else the one with most rows, since
    test protocols begin with a title sheet. Dates become seconds since the first one, empty cells missing values,
    formulas what Excel last made of them.

    Raises
    ------
    BadInput
        openpyxl is not installed, the file is damaged or too large, or it has no such sheet.
    """
    try:
        import openpyxl
    except ImportError:
        raise not_installed(str(path), "reading Excel", "openpyxl", "excel", "save the table as CSV") from None
    _check_size(path)
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        try:
            names = _sheets(path, layout, book.sheetnames)
            filled = {name: list(_rows(book[name], layout)) for name in names if hasattr(book[name], "iter_rows")}
            chosen = max(filled, key=lambda name: len(filled[name]), default=names[0])
            several = len(book.sheetnames) > 1
            hint = f" (sheets: {', '.join(book.sheetnames)})" if several else ""
        finally:
            book.close()
    except BadInput:
        raise
    except Exception as error:  # openpyxl raises whatever a damaged byte leads to
        found = f"it cannot be read as Excel ({' '.join(str(error).split())[:120]})"
        raise BadInput(str(path), found, "save the table as CSV and import that") from error
    table = _table(path, layout, filled.get(chosen, []), {str(text) for text in texts}, hint)
    read = f"sheet '{chosen}' was read, of {', '.join(book.sheetnames)}"
    return replace(table, notes=(read,)) if several and layout.variable is None else table


def _check_size(path: Path) -> None:
    """Refuse what would unpack to more than memory can hold."""
    try:
        with zipfile.ZipFile(path) as parts:
            size = sum(one.file_size for one in parts.infolist())
    except Exception as error:  # zipfile raises whatever a damaged directory leads to
        raise BadInput(str(path), f"the file is damaged ({error})", "copy it again from its origin") from None
    if size > LARGEST:
        raise BadInput(str(path), f"it unpacks to more than {LARGEST // 1_000_000} MB", "save the table as CSV")


def _sheets(path: Path, layout: FileLayout, names: Sequence[str]) -> Sequence[str]:
    """The sheets that may be meant."""
    if layout.variable is None:
        return names
    if layout.variable not in names:
        found = f"there is no sheet '{layout.variable}'"
        raise BadInput(str(path), found, f"sheets there: {', '.join(names)}", parameter="variable")
    return [layout.variable]


def _rows(sheet: Any, layout: FileLayout) -> Iterator[SheetRow]:
    """The rows that hold something, with their numbers, without empty cells at their ends."""
    for number, cells in enumerate(sheet.iter_rows(values_only=True), start=1):
        if number > layout.skip_lines and any(cell is not None for cell in cells):
            yield number, cells


def _table(path: Path, layout: FileLayout, rows: list[SheetRow], wanted: set[str], hint: str) -> ForeignTable:
    top = _head(rows)
    if len(rows) - top < 1:
        raise BadInput(str(path), "it holds no data", f"give a sheet with at least two rows of numbers{hint}")
    width = max(len(cells) for _, cells in rows[top:])
    while width and all(len(cells) < width or cells[width - 1] is None for _, cells in rows):
        width -= 1
    headers, units, first = _headers(layout, rows, top, width)
    names, said = named_columns(headers)
    body = [(number, [*cells[:width], *[None] * (width - len(cells))]) for number, cells in rows[first:]]
    columns: dict[str, Array] = {}
    bad: dict[str, BadCell] = {}
    seconds: dict[str, str] = {}
    for place, name in enumerate(names):
        cells = [(number, row[place]) for number, row in body]
        columns[name], wrong, dated = _numbers(cells, layout)
        if wrong is not None:
            bad[name] = wrong
        if dated:
            seconds[name] = "s"
    texts = {name: [_text(row[place]) for _, row in body] for place, name in enumerate(names) if name in bad}
    kept = {name: words for name, words in texts.items() if name in wanted or name.casefold() in wanted}
    lines = np.array([number for number, _ in body])
    told = said | dict(zip(names, units, strict=False)) if units else said
    return ForeignTable(
        str(path), columns, {k: v for k, v in told.items() if v} | seconds, texts=kept, bad_cells=bad, rows=lines,
        hint=hint,
    )  # fmt: skip


def _head(rows: list[SheetRow]) -> int:
    """The row of the names: the first that has as many cells as the table below is wide; titles above are left out."""
    sample = list(islice(rows, _SAMPLE_ROWS))
    full = max((sum(cell is not None for cell in cells) for _, cells in sample), default=0)
    return next((k for k, (_, cells) in enumerate(sample) if sum(c is not None for c in cells) * 2 > full), 0)


def _headers(layout: FileLayout, rows: list[SheetRow], top: int, width: int) -> tuple[list[str], list[str], int]:
    """Headers, units of a row of their own, and the first row of data."""
    first = [_text(cell) for cell in rows[top][1][:width]]
    has_names = looks_like_names(first) if layout.header is None else layout.header
    headers = first if has_names else [""] * width
    headers = [*layout.columns[:width], *headers[len(layout.columns[:width]) :]]
    headers += [""] * (width - len(headers))
    second = [_text(cell) for cell in rows[top + 1][1][:width]] if has_names and len(rows) > top + 1 else []
    if not looks_like_units(second):
        return headers, [], top + int(has_names)
    return headers, [cell.strip(" []()") for cell in second], top + 2


def _numbers(cells: list[tuple[int, Any]], layout: FileLayout) -> tuple[Any, BadCell | None, bool]:
    """Values of a column, its first cell that is no number, and whether it holds dates."""
    missing = {"", *(text.casefold() for text in layout.missing)}
    dates = [cell for _, cell in cells if isinstance(cell, datetime | date | time | timedelta)]
    values = np.full(len(cells), np.nan)
    others: dict[str, int] = {}
    for k, (number, cell) in enumerate(cells):
        if isinstance(cell, bool | int | float):
            values[k] = float(cell)
        elif isinstance(cell, str) and cell.strip().casefold() not in missing:
            others.setdefault(cell.strip(), number)
        elif dates and cell is not None and not isinstance(cell, str):
            values[k] = _seconds(cell, dates[0])
    if others:
        (text, number), *more = list(others.items())[:6]
        return np.empty(0), BadCell(number, text, others=tuple(word for word, _ in more)), False
    return values, None, bool(dates)


def _seconds(cell: Any, first: Any) -> float:
    """Seconds since the first date, time of day or duration of a column."""
    return float(_span(cell).total_seconds() - _span(first).total_seconds())


def _span(cell: Any) -> timedelta:
    if isinstance(cell, timedelta):
        return cell
    if isinstance(cell, datetime):
        return cell - datetime(1900, 1, 1)
    if isinstance(cell, date):
        return datetime(cell.year, cell.month, cell.day) - datetime(1900, 1, 1)
    return timedelta(hours=cell.hour, minutes=cell.minute, seconds=cell.second, microseconds=cell.microsecond)


def _text(cell: Any) -> str:
    return "" if cell is None else str(cell)


def _match(path: Path, head: bytes) -> Match:
    if head[:4] != b"PK\x03\x04":
        return Match.NO
    try:
        with zipfile.ZipFile(path) as parts:
            return Match.CONTENT if _WORKBOOK in parts.namelist() else Match.NO
    except Exception:  # zipfile raises whatever a damaged directory leads to
        return Match.NO


EXCEL = FileFormat("Excel", _match, read_excel)
