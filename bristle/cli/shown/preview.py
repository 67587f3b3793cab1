"""What `bristle import --preview` says."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bristle.cli.output.manner import OPTIONS, answer, manner, say, stdout
from bristle.cli.output.parameters import option
from bristle.cli.output.tables import words_table
from bristle.cli.output.working import working
from recordings.importers import ImportMapping, as_json, load_mapping, preview, with_changes

if TYPE_CHECKING:
    from rich.table import Table

    from recordings.importers import ImportPreview

MOST_COLUMNS = 60
"""Columns that are shown."""


def show_preview(file: Path, mapping: str | None, changes: Mapping[str, Any]) -> None:
    """Say what is in a foreign file, and the command that would import it. Raises BadInput when it cannot be read."""
    known = load_mapping(mapping) if mapping else ImportMapping()
    with working("looking"):
        found = preview(file, with_changes(known, changes, "options"))
    guessed = [word for parameter, value in found.options for word in (option(parameter), value)]
    command = typed(manner().given, file, guessed)
    answer(as_json(found) | {"options": guessed, "command": command})
    say(f"{file}: {found.rows} rows, {len(found.columns)} columns")
    stdout().print(columns_table(found), soft_wrap=False)
    say(*found.notes)
    if found.missing:
        say(f"still to be said: {found.missing}")
    say("", "to import it, type:", f"  {command}")


def columns_table(found: ImportPreview) -> Table:
    """The columns of a preview."""
    rows = [
        (one.name, one.unit or "-", one.holds, _span(one.low, one.high) or one.example, one.becomes)
        for one in found.columns[:MOST_COLUMNS]
    ]
    left = len(found.columns) - MOST_COLUMNS
    return words_table(
        ("column", "unit", "holds", "from .. to", "becomes"), rows, note=f"and {left} more" if left > 0 else ""
    )


def typed(given: Sequence[str], file: Path, guessed: Sequence[str]) -> str:
    """The command to type: what was typed already, without the options that only look, and with what was guessed."""
    said = [word for word in given if word not in {"--preview", *OPTIONS}]
    kept = said if said[:1] == ["import"] else ["import", str(file)]
    new = [] if any(word == "--to" or word.startswith("--to=") for word in kept) else ["--to", f"{file.stem}.h5"]
    return shlex.join(["bristle", *kept, *new, *guessed])


def _span(low: float | None, high: float | None) -> str:
    return "" if low is None or high is None else f"{low:.5g} .. {high:.5g}"
