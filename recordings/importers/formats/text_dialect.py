"""Guessing how a text table is laid out: its separator, and whether its first row holds names or units."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from recordings.units import find_unit

WHITESPACE = " "
_SEPARATORS = ("\t", ";", ",", WHITESPACE)
_NUMBER_LIKE = re.compile(r"[+-]?(\d[\d.,]*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)


def split_row(line: str, separator: str) -> list[str]:
    """The cells of one line; quotes are respected, except between blanks."""
    if separator == WHITESPACE:
        return line.split()
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])


def number_like(cell: str) -> bool:
    """Whether a cell is a number under any decimal sign.

    >>> [number_like(cell) for cell in ("1.5", "1,5", "-2e-3", "NaN", "1.003.000", "time", "")]
    [True, True, True, True, True, False, False]
    """
    return _NUMBER_LIKE.fullmatch(cell.strip()) is not None


def guess_separator(lines: Sequence[str]) -> str:
    """The separator under which the lines fall into the most regular rows of numbers.

    >>> guess_separator(["t;x", "0,1;1,5", "0,2;1,6"]), guess_separator(["0.1  1.5", "0.2  1.6"])
    (';', ' ')
    """
    data = lines[1:] or lines
    scores = {separator: _score(data, separator) for separator in _SEPARATORS}
    best = max(scores, key=lambda separator: scores[separator])
    return best if scores[best] > 0 else ","


def _score(lines: Sequence[str], separator: str) -> float:
    rows = [split_row(line, separator) for line in lines]
    width = len(rows[0]) if rows else 0
    if width < 2:
        return 0.0
    regular = sum(len(row) == width for row in rows) / len(rows)
    cells = [cell for row in rows for cell in row]
    return regular * (0.01 + sum(number_like(cell) or not cell.strip() for cell in cells) / len(cells))


def looks_like_names(cells: Sequence[str]) -> bool:
    """Whether a row holds names: some text and no number."""
    return any(cell.strip() for cell in cells) and not any(number_like(cell) for cell in cells)


def looks_like_units(cells: Sequence[str]) -> bool:
    """Whether a row below the names holds units: no number, and a unit the table knows."""
    return looks_like_names(cells) and any(find_unit(cell.strip(" []()")) for cell in cells)
