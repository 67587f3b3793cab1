"""The one style of the gallery, and the list of its pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "models" / "pictures"


@dataclass(frozen=True)
class Picture:
    """name : of the file and the function that draws it; title; page : of docs/models that explains it; draw(axes)."""

    name: str
    title: str
    page: str
    draw: Callable[[Any], None]


PICTURES: list[Picture] = []
"""Every picture, in the order of the source document."""


def picture(title: str, page: str) -> Callable[[Callable[[Any], None]], Callable[[Any], None]]:
    """Put a function that draws into axes on the list."""

    def listed(draw: Callable[[Any], None]) -> Callable[[Any], None]:
        PICTURES.append(Picture(draw.__name__, title, page, draw))
        return draw

    return listed


def write(folder: Path = FOLDER) -> list[Path]:
    """Write every picture as NAME.svg into a folder; returns the files."""
    mpl.use("svg")
    from matplotlib import pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    found = []
    with mpl.rc_context({"font.size": 8, "svg.hashsalt": "bristle", "svg.fonttype": "none", "lines.linewidth": 1.0}):
        for one in PICTURES:
            figure, axes = plt.subplots(figsize=(4.2, 2.9), layout="constrained")
            one.draw(axes)
            axes.set_title(one.title, fontsize=8)
            found.append(folder / f"{one.name}.svg")
            figure.savefig(found[-1], metadata={"Date": None})
            plt.close(figure)
    return found
