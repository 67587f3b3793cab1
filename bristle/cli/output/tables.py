"""Tables that fit the terminal: what does not fit is broken into lines, and nothing is cut."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

NARROWEST, WIDEST = 60, 160
"""Characters that a table may have: a pipe says 80."""
LONGEST_NAME = 34


def width() -> int:
    """How wide a table may be here, in characters."""
    return min(max(shutil.get_terminal_size().columns, NARROWEST), WIDEST)


def words_table(
    heads: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    title: str = "",
    note: str = "",
    right: Sequence[str] = (),
) -> Table:
    """A table of words, in which nothing is markup. The first column, a name, keeps to one line up to `LONGEST_NAME`
    characters; every other one breaks at blanks, and longer words anywhere but in heads, so that nothing is cut.
    A column in which no row has anything is left out.

    right : heads of the columns that are flush right.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    said = [[str(cell) for cell in row] for row in rows]
    used = [place for place in range(len(heads)) if not said or any(row[place] for row in said)]
    heads, said = [heads[place] for place in used], [[row[place] for place in used] for row in said]
    longest = max((len(row[0]) for row in said if row), default=0)
    table = Table(box=SIMPLE_HEAD, pad_edge=False, title_justify="left", caption_justify="left")
    table.title, table.caption = Text(title) if title else None, Text(note) if note else None
    for place, head in enumerate(heads):
        whole = place == 0 and longest <= LONGEST_NAME
        table.add_column(
            Text(head), overflow="fold", justify="right" if head in right else "left", no_wrap=whole,
            min_width=max(map(len, head.split()), default=0),
        )  # fmt: skip
    for row in said:
        table.add_row(*map(Text, row))
    return table


def in_lines(table: Table, characters: int | None = None) -> list[str]:
    """The lines of a table as text, `characters` wide."""
    import io

    from rich.console import Console

    out = Console(file=io.StringIO(), width=characters or width(), color_system=None, highlight=False)
    out.print(table)
    text: str = out.file.getvalue()  # type: ignore[attr-defined]
    return [line.rstrip() for line in text.splitlines()]
