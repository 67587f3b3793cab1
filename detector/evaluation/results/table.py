"""A table: rows of text under headings."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ResultTable:
    """name : of its file; title; note : how to read it; heads and rows : text."""

    name: str
    title: str
    note: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def csv(self) -> str:
        """As comma-separated values."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerows([self.heads, *self.rows])
        return text.getvalue()

    def markdown(self) -> str:
        """As a section of a Markdown page."""
        lines = ["| " + " | ".join(row) + " |" for row in (self.heads, ("---",) * len(self.heads), *self.rows)]
        return "\n".join([f"## {self.title}", "", self.note, "", *lines, ""])


def number(value: Any) -> str:
    """A number as tables write it; a dash for none."""
    if value is None:
        return "-"
    return f"{float(value):.0f}" if abs(float(value)) >= 1000 else f"{float(value):.4g}"
