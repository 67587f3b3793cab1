"""MATLAB files that hold all of a recording.

Each signal is a variable of its name, or of what is left of it in letters that MATLAB allows; the text about the
recording is the variable `bristle_recording`, and `bristle_columns` says which variable is which column.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from recordings.atomic_files import appearing
from recordings.exchange.data_frames import ABOUT
from recordings.exchange.table_form import WholeTable

COLUMNS = "bristle_columns"
LONGEST = 50
"""Most letters that are kept of a name; MATLAB allows 63, and a number may follow."""


def write_matlab_table(path: Path, table: WholeTable) -> None:
    """Write a table as a file of version 5, whole or not at all. Raises BadInput when the disk refuses."""
    from scipy.io import savemat

    names = _variables([*table.columns])
    content: dict[str, Any] = {names[column]: values[:, None] for column, values in table.columns.items()}
    content |= {ABOUT: table.about, COLUMNS: json.dumps({variable: column for column, variable in names.items()})}
    with appearing(path) as draft, draft.open("wb") as file:
        savemat(file, content, long_field_names=True, do_compression=False)


def _variables(columns: list[str]) -> dict[str, str]:
    """A variable of MATLAB for each column."""
    names: dict[str, str] = {}
    for number, column in enumerate(columns):
        word = re.sub(r"\W", "_", column, flags=re.ASCII)[:LONGEST]
        word = word if word[:1].isalpha() else f"signal_{word}"
        taken = {name.casefold() for name in (*names.values(), ABOUT, COLUMNS)}
        names[column] = word if word.casefold() not in taken else f"{word}_{number}"
    return names
