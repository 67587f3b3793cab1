"""Pictures and tables of the studies: small SVG files and markdown, the same bytes each time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "studies"


def axes(rows: int, columns: int, size: tuple[float, float]) -> tuple[Any, Any]:
    """A figure in the one style."""
    mpl.use("svg")
    from matplotlib import pyplot as plt

    mpl.rcParams.update({"font.size": 8, "svg.hashsalt": "bristle", "svg.fonttype": "none", "lines.linewidth": 1.0})
    return plt.subplots(rows, columns, figsize=size, layout="constrained")


def save(figure: Any, name: str) -> None:
    """Write docs/studies/NAME.svg."""
    FOLDER.mkdir(exist_ok=True)
    figure.savefig(FOLDER / f"{name}.svg", metadata={"Date": None})


def envelope(t: NDArray[np.float64], y: NDArray[np.float64], most: int = 600) -> tuple[Any, Any]:
    """At most `most` points that look the same: lowest and highest of each stretch, so that no spike is lost."""
    if len(t) <= most:
        return t, y
    cuts = np.linspace(0, len(t), most // 2 + 1).astype(int)
    ends = [(a + int(np.argmin(y[a:b])), a + int(np.argmax(y[a:b]))) for a, b in pairwise(cuts)]
    places = np.array([i for pair in ends for i in sorted(pair)])
    return t[places], y[places]


def rows_of(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """The lines of a table."""
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]


def page(name: str, title: str, head: Sequence[str], rows: Sequence[Sequence[str]], note: str) -> None:
    """Write docs/studies/NAME.md: a note and a table, without a picture."""
    lines = rows_of(head, rows)
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.md").write_text("\n".join([f"# {title}", "", note, "", *lines, ""]), encoding="utf-8")


def table(name: str, title: str, head: Sequence[str], rows: Sequence[Sequence[str]], note: str = "") -> str:
    """Write docs/studies/NAME.md and return it."""
    lines = [f"# {title}", "", *rows_of(head, rows)]
    text = "\n".join([*lines, "", *([note, ""] if note else []), f"![{title}]({name}.svg)", ""])
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.md").write_text(text, encoding="utf-8")
    return text
