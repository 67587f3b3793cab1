"""The page of a comparison: what changed, the table, and both before and after over the same axes."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from typing import Any

import numpy as np

from identification.comparison.result import ComparedCurve, ComparedPicture, ComparisonResult
from identification.report.assembly import Front, assembled, save_page
from identification.report.canvas import BEFORE, MEASURED, NARROW, WIDE, canvas, finish_legend
from identification.report.decimate import extremes
from identification.report.openings import comparison_opening
from identification.report.section import Section
from identification.report.wording.numbers import number

MOST_POINTS = 30_000


def write_comparison_report(path: str | os.PathLike[str], found: ComparisonResult) -> None:
    """Write the page as one self-contained HTML file, all or nothing. Raises BadInput when it cannot be written."""
    save_page(path, comparison_page(found))


def comparison_page(found: ComparisonResult) -> str:
    """The page as HTML; it needs no network, and every text of the user's is escaped."""
    front = Front(
        "Valve comparison", f"Valve {found.tag}: before and after" if found.tag else "Before and after",
        (f"{found.before} and {found.after}", f"Report of {datetime.now(UTC):%Y-%m-%d}"),
        f"{found.before} and {found.after} - comparison", comparison_opening(found),
    )  # fmt: skip
    rows = [
        {"name": q.name, "unit": q.unit, "before": _sized(q.before.value, q.before.std),
         "after": _sized(q.after.value, q.after.std), "difference": number(q.difference),
         "interval": f"{number(q.lower)} to {number(q.upper)}", "changed": q.changed}
        for q in found.quantities
    ]  # fmt: skip
    head, *more = found.sentences()
    words = {
        "head": head,
        "more": more,
        "rows": rows,
        "level": number(100 * found.level),
        "changed": bool(found.changed),
    }
    names = [f"picture{i}" for i in range(len(found.pictures))]
    words["pictures"] = [(name, p.title) for name, p in zip(names, found.pictures, strict=True)]
    plots = {name: _drawn(p) for name, p in zip(names, found.pictures, strict=True)}
    return assembled(front, [Section("comparison", "What changed", words, plots)])


def stacked_comparison(found: ComparisonResult) -> Any:
    """Its pictures one below the other, as a bokeh layout."""
    from bokeh.layouts import column

    return column(*map(_drawn, found.pictures), sizing_mode="stretch_width")


def _sized(value: float, std: float) -> str:
    return f"{number(value)} ± {number(std)}"


def _drawn(picture: ComparedPicture) -> Any:
    plot = canvas(picture.x_label, picture.y_label, 380)
    for curves, colour, width in ((picture.before, BEFORE, WIDE), (picture.after, MEASURED, NARROW)):
        for curve in curves:
            _add(plot, curve, colour, width)
    finish_legend(plot)
    return plot


def _add(plot: Any, curve: ComparedCurve, colour: str, width: float) -> None:
    kept = extremes([curve.x, curve.y], MOST_POINTS)
    x, y = curve.x[kept].astype(np.float32), curve.y[kept].astype(np.float32)
    plot.line(x, y, color=colour, line_width=width, line_alpha=0.8, legend_label=curve.name)
    if curve.bars is not None:
        bars = curve.bars[kept]
        plot.segment(x, y - bars, x, y + bars, color=colour, line_width=1.5)
