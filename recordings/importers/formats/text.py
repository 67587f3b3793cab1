"""Reading CSV, TSV and blank-separated text, plain or gzip-compressed, into a table.

Cells are converted in blocks, so that memory is in proportion to the numbers and not to their text.
"""

from __future__ import annotations

import csv
import functools
import gzip
import math
import zlib
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import TextIO, cast

import numpy as np

from recordings.arrays import Array
from recordings.column_headers import named_columns
from recordings.errors import BadInput
from recordings.importers.file_format import FileFormat, Match
from recordings.importers.formats.text_dialect import (
    WHITESPACE,
    guess_separator,
    looks_like_names,
    looks_like_units,
    number_like,
    split_row,
)
from recordings.importers.mapping import FileLayout
from recordings.importers.table import BadCell, ForeignTable, check_expansion

_BLOCK_ROWS, _BLOCK_CELLS = 20_000, 400_000
_SAMPLE_LINES = 60
_MOST_OTHERS = 5
"""Texts of a column that are told of besides the first."""
_LONGEST_LINE = 1 << 20
"""Checked before a line is held: a file of a few MB can unpack into gigabytes without a line's end."""
_ALWAYS_CHARACTERS, _MOST_PACKED = 500_000, 20
"""Text may be so long, and longer by so many times its file: packed measurements are a third or a tenth of theirs."""
_MISSING = frozenset({"", "-", "--", "?", "na", "n/a", "#n/a", "nan", "null", "none", "nil", "missing"})

TextLine = tuple[int, str]


def read_text(path: Path, layout: FileLayout, texts: Iterable[str | int] = ()) -> ForeignTable:
    """Read a text table.

    Parameters
    ----------
    path : Path
        The file; gzip is recognised by its content.
    layout : FileLayout
        How it is laid out; what is left open is guessed.
    texts : iterable of str or int
        Columns wanted as text as well.

    Raises
    ------
    BadInput
        The file is no text, its rows differ in length, or it holds no data.
    """
    encodings = [layout.encoding] if layout.encoding else ["utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            with _opened(path, encoding) as stream:
                return _Parser(path, layout, tuple(texts)).table(stream)
        except UnicodeDecodeError:
            continue
        except LookupError:
            break
        except (OSError, EOFError, zlib.error) as error:
            remedy = "copy it again from its origin"
            raise BadInput(str(path), f"the compressed file is damaged ({error})", remedy) from error
        except csv.Error as error:
            found, remedy = f"it is no table ({error})", "check the quotes and the separator"
            raise BadInput(str(path), found, remedy, parameter="separator") from error
    found, remedy = f"it is not text in {encodings[0]}", "give its encoding: utf-8, latin-1 ..."
    raise BadInput(str(path), found, remedy, parameter="encoding")


def _opened(path: Path, encoding: str) -> TextIO:
    with path.open("rb") as file:
        head = file.read(4096)
    if head[:2] == b"\x1f\x8b":
        return cast(TextIO, gzip.open(path, "rt", encoding=encoding, newline=None))
    if head[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        return path.open(encoding="utf-16", newline=None)
    if b"\0" in head:
        raise BadInput(str(path), "it is a binary file of an unknown kind", "give CSV, TSV, .mat or Parquet")
    return path.open(encoding=encoding, newline=None)


class _Parser:
    """One pass over the lines of a text table."""

    def __init__(self, path: Path, layout: FileLayout, texts: tuple[str | int, ...]) -> None:
        self._path, self._layout, self._wanted_texts = path, layout, texts

    def table(self, stream: TextIO) -> ForeignTable:
        lines = self._lines(stream)
        sample = list(islice(lines, _SAMPLE_LINES))
        if sample and sample[0][1].lower().startswith("sep=") and len(sample[0][1]) == 5:
            separator, sample = sample[0][1][4], sample[1:]
        else:
            separator = self._layout.separator_sign or guess_separator([line for _, line in sample])
        if not sample:
            raise BadInput(str(self._path), "it holds no data", "give a file with at least two rows of numbers")
        headers, units, skipped = self._head(sample, separator)
        check_expansion(self._path, 0, len(headers))
        names, named_units = named_columns(headers)
        empty = ForeignTable(str(self._path), dict.fromkeys(names, np.empty(0)))
        columns = _Columns(names, self._layout, {empty.name_of(text) for text in self._wanted_texts})
        for block in self._blocks(chain(sample[skipped:], lines), separator, len(names)):
            columns.add(block)
            check_expansion(self._path, len(columns.rows) * (1 + len(names)))
        if len(columns.rows) == 0:
            raise BadInput(str(self._path), "it holds no data", "give a file with at least two rows of numbers")
        return columns.table(str(self._path), named_units | units)

    def _lines(self, stream: TextIO) -> Iterator[TextLine]:
        """The lines that count, with their number in the file."""
        comment, left = self._layout.comment, _ALWAYS_CHARACTERS + _MOST_PACKED * self._path.stat().st_size
        for number, line in enumerate(iter(functools.partial(stream.readline, _LONGEST_LINE), ""), start=1):
            if len(line) == _LONGEST_LINE:
                remedy = "give a table, one row a line"
                raise BadInput(f"{self._path}: line {number}", f"it has {_LONGEST_LINE} characters or more", remedy)
            left -= len(line)
            if left < 0:
                found = f"it unpacks into more than {_MOST_PACKED} times its size"
                raise BadInput(f"{self._path}: line {number}", found, "unpack it first, if it holds measurements")
            line = line.rstrip("\n")
            blank = not line.strip() or (comment and line.lstrip().startswith(comment))
            if number > self._layout.skip_lines and not blank:
                yield number, line

    def _head(self, sample: list[TextLine], separator: str) -> tuple[list[str], dict[str, str], int]:
        """The headers of the columns, units from a row of their own, and how many lines they took."""
        first = split_row(sample[0][1], separator)
        has_names = looks_like_names(first) if self._layout.header is None else self._layout.header
        while has_names and first and not first[-1].strip():
            first.pop()
        headers = first if has_names else [""] * len(first)
        for place, name in enumerate(self._layout.columns[: len(headers)]):
            headers[place] = name
        second = split_row(sample[1][1], separator) if has_names and len(sample) > 1 else []
        if not looks_like_units(second):
            return headers, {}, int(has_names)
        names, _ = named_columns(headers)
        units = {name: cell.strip(" []()") for name, cell in zip(names, second, strict=False) if cell.strip()}
        return headers, units, 2

    def _blocks(self, lines: Iterable[TextLine], separator: str, width: int) -> Iterator[list[tuple[int, list[str]]]]:
        rows = self._rows(lines, separator, width)
        n_rows = max(min(_BLOCK_ROWS, _BLOCK_CELLS // max(width, 1)), 1)
        while block := list(islice(rows, n_rows)):
            yield block

    def _rows(self, lines: Iterable[TextLine], separator: str, width: int) -> Iterator[tuple[int, list[str]]]:
        """Rows of `width` cells with their number; empty cells too many are dropped, anything else is refused."""
        for number, cells in _split(lines, separator):
            while len(cells) > width and not cells[-1].strip():
                cells.pop()
            if len(cells) != width:
                found = f"it has {len(cells)} cells, the first row has {width}"
                remedy = "every row has the same cells; check the row, the separator and the lines before the table"
                where = f"{self._path}: row {number}"
                raise BadInput(where, found, remedy, parameter=("separator", "skip_lines"))
            yield number, cells


def _split(lines: Iterable[TextLine], separator: str) -> Iterator[tuple[int, list[str]]]:
    if separator == WHITESPACE:
        for number, line in lines:
            yield number, line.split()
        return
    current = 0

    def texts() -> Iterator[str]:
        nonlocal current
        for number, line in lines:
            current = number
            yield line

    for cells in csv.reader(texts(), delimiter=separator, skipinitialspace=True):
        yield current, cells


class _Columns:
    """Columns that grow block by block."""

    def __init__(self, names: Sequence[str], layout: FileLayout, texts: set[str]) -> None:
        self._names, self._layout = names, layout
        self._missing = _MISSING | {text.casefold() for text in layout.missing}
        self._parts: dict[str, list[Array]] = {name: [] for name in names}
        self._texts: dict[str, list[str]] = {name: [] for name in texts}
        self._bad: dict[str, BadCell] = {}
        self.rows = array("q")

    def add(self, block: list[tuple[int, list[str]]]) -> None:
        """Convert a block of rows. A column with a cell that is no number is given up from there on."""
        numbers, rows = zip(*block, strict=True)
        self.rows.extend(numbers)
        for name, cells in zip(self._names, zip(*rows, strict=True), strict=True):
            if name in self._texts:
                self._texts[name].extend(cells)
            if name not in self._bad:
                values, bad = self._convert(cells)
                self._parts[name].append(values)
                if bad is not None:
                    self._bad[name] = self._bad_cell(numbers[bad], cells[bad])
                    self._parts[name].clear()
            if name in self._bad:
                self._bad[name] = self._further(self._bad[name], cells)

    def table(self, where: str, units: dict[str, str]) -> ForeignTable:
        empty = np.empty(0)
        columns = {name: np.concatenate(parts) if parts else empty for name, parts in self._parts.items()}
        rows = np.frombuffer(self.rows, np.int64)
        return ForeignTable(where, columns, units, texts=self._texts, bad_cells=self._bad, rows=rows)

    def _convert(self, cells: Sequence[str]) -> tuple[Array, int | None]:
        """Values of the cells, and the index of the first that is neither a number nor missing."""
        if self._layout.decimal == "." and not self._layout.thousands and all(map(_is_written_number, cells)):
            try:
                return np.array(list(map(float, cells))), None
            except ValueError:
                pass  # cell by cell then
        values = np.full(len(cells), np.nan)
        for index, cell in enumerate(cells):
            value = self._number(cell.strip())
            if value is None:
                return values, index
            values[index] = value
        return values, None

    def _number(self, cell: str) -> float | None:
        if cell.casefold() in self._missing:
            return math.nan
        if self._layout.thousands:
            cell = cell.replace(self._layout.thousands, "")
        if self._layout.decimal != ".":
            if "." in cell:
                return None
            cell = cell.replace(self._layout.decimal, ".")
        try:
            return float(cell) if _is_written_number(cell) else None
        except ValueError:
            return None

    def _further(self, bad: BadCell, cells: Sequence[str]) -> BadCell:
        """The same with what else in the column is no number; of a column of texts, no more than a few."""
        if len(bad.others) >= _MOST_OTHERS:
            return bad
        others = dict.fromkeys(bad.others)
        for cell in map(str.strip, cells):
            new = cell != bad.text and cell not in others and self._number(cell) is None
            if new and not (number_like(bad.text) and number_like(cell)):  # one remedy mends all of those
                others[cell] = None
                if len(others) >= _MOST_OTHERS:
                    break
        return replace(bad, others=tuple(others))

    def _bad_cell(self, row: int, cell: str) -> BadCell:
        if not number_like(cell):
            return BadCell(row, cell.strip())
        other = "," if self._layout.decimal == "." else "."
        remedy = f"the decimal sign is '{self._layout.decimal}' here; where it is '{other}', say so"
        return BadCell(row, cell.strip(), remedy, "decimal")


def _is_written_number(cell: str) -> bool:
    """Whether what Python takes for a number is one elsewhere: not 1_0, and no digits but 0 to 9."""
    return cell.isascii() and "_" not in cell


def _match(path: Path, head: bytes) -> Match:
    return Match.REST


TEXT = FileFormat("text", _match, read_text)
