"""What every reader of foreign files hands over: columns of numbers by name, and where each row stood in the file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from recordings.arrays import Array, Integers
from recordings.column_headers import did_you_mean, split_unit
from recordings.errors import BadInput

_MOST_NAMES = 20
MOST_COLUMNS = 4096
_ALWAYS_BYTES = 64_000_000
_MOST_EXPANDED = 30
"""Numbers in memory may take this many times the bytes of their file: compressed measurements take three to ten."""


def check_expansion(path: Path, n_values: int, n_columns: int = 1) -> None:
    """Refuse a file that is small and declares, or unpacks into, numbers that fill the memory; before they do.

    n_values : how many numbers there are in all; n_columns : in how many columns.
    """
    if n_columns > MOST_COLUMNS:
        remedy = f"give a table of at most {MOST_COLUMNS} columns"
        raise BadInput(str(path), f"it has {n_columns} columns", remedy)
    allowed = _ALWAYS_BYTES + _MOST_EXPANDED * path.stat().st_size
    if 8 * n_values > allowed:
        found = f"its {n_values} numbers need {8e-6 * n_values:.0f} MB of memory, far more than the file has"
        raise BadInput(str(path), found, "give a file of measurements, in parts where it is large")


@dataclass(frozen=True)
class BadCell:
    """The first cell of a column that is no number.

    row : number of its row in the file; text : what it says; remedy, parameter : as in `BadInput`; others : what
    further cells of the column say that are no numbers either, each once.
    """

    row: int
    text: str
    remedy: str = "a column that is used holds only numbers; correct the cell, or say that it means no value"
    parameter: str | None = "missing"
    others: tuple[str, ...] = ()


@dataclass(frozen=True)
class ForeignTable:
    """Columns of a foreign file.

    where : the file, for messages; columns : values by name, each of shape (n_rows,), missing cells NaN; units : by
    column, where the file says them; constants : single numbers beside the columns; texts : the columns asked for as
    text; bad_cells : columns that hold something else than numbers; rows : number of each row in the file;
    row_word : what a row is called; hint : matrices of which one can be chosen as the `variable`, for messages;
    notes : sentences on what the reader chose.
    """

    where: str
    columns: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)
    texts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    bad_cells: Mapping[str, BadCell] = field(default_factory=dict)
    rows: Integers | None = None
    row_word: str = "row"
    hint: str = ""
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the columns, in the order of the file."""
        return tuple(self.columns)

    def find(self, reference: str | int) -> str | None:
        """The column meant by a name, by a name in other capitals, or by a number from 1; None when there is none."""
        text = str(reference)
        if text in self.columns:
            return text
        wanted = {text.casefold(), split_unit(text)[0].casefold()}
        same = [name for name in self.columns if name.casefold() in wanted]
        if len(same) == 1:
            return same[0]
        number = int(text) if re.fullmatch(r"[0-9]{1,6}", text) else 0
        return self.names[number - 1] if 1 <= number <= len(self.names) else None

    def name_of(self, reference: str | int) -> str:
        """As `find`; `BadInput` listing the columns when there is none."""
        name = self.find(reference)
        if name is None:
            there = ", ".join(self.names[:_MOST_NAMES]) + (" ..." if len(self.names) > _MOST_NAMES else "")
            found, close = f"there is no column '{reference}'", did_you_mean(str(reference), self.names)
            remedy = f"{close}{' ' if close else ''}columns there: {there or 'none'}{self.hint}"
            raise BadInput(self.where, found, remedy, parameter="variable" if self.hint else None)
        return name

    def numbers(self, reference: str | int) -> Array:
        """The values of a column, shape (n_rows,); `BadInput` naming the row of a cell that is no number."""
        name = self.name_of(reference)
        if name in self.bad_cells:
            self.refuse([name])
        return self.columns[name]

    def refuse(self, names: Sequence[str]) -> None:
        """Raise BadInput for columns that hold something else than numbers, with all that they hold; else nothing."""
        bad = [(name, self.bad_cells[name]) for name in names if name in self.bad_cells]
        if not bad:
            return
        name, first = bad[0]
        found = f"'{first.text[:40]}' in column '{name}' is not a number"
        texts = [(name, text) for name, one in bad for text in (one.text, *one.others)][1:]
        if texts:
            found += "; nor is " + ", ".join(f"'{text[:40]}' in column '{column}'" for column, text in texts)
        raise BadInput(f"{self.where}: {self.row_word} {first.row}", found, first.remedy, parameter=first.parameter)

    def row(self, index: int) -> str:
        """Where a row stood in the file, for messages."""
        number = int(self.rows[index]) if self.rows is not None else index + 1
        return f"{self.where}: {self.row_word} {number}"
