"""A page of findings: sentences, tables and curves, for results that are not a model of a valve."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import cycle
from typing import Any

from identification.report.assembly import Front, assembled, save_page
from identification.report.canvas import ALARM, INK, MEASURED, NEUTRAL, REFERENCE, RESIDUAL, canvas, finish_legend
from identification.report.decimate import extremes
from identification.report.section import Section
from recordings import Array, ReportOpening

Curves = Mapping[str, tuple[str, str, Sequence[tuple[str, Array, Array]]]]
"""By the name of the picture: label of x, label of y, and the lines as (name, x, y)."""
MOST = 4000
"""Points of a line that are drawn."""
COLOURS = (REFERENCE, MEASURED, INK, RESIDUAL, ALARM, NEUTRAL)
"""Of the lines of a picture, in their order."""


@dataclass(frozen=True)
class Findings:
    """What the page shows. heading, kind, opening : its front; sentences : the answer first; tables : (head, rows);
    curves; lines : below the heading.
    """

    heading: str
    kind: str
    sentences: tuple[str, ...]
    tables: Sequence[tuple[Sequence[str], Sequence[Sequence[str]]]]
    curves: Curves
    opening: ReportOpening
    lines: tuple[str, ...] = ()


def write_findings(path: str | os.PathLike[str], findings: Findings) -> None:
    """Write the page as one HTML file that needs no network. Raises BadInput when the path cannot be written."""
    front = Front(
        findings.kind,
        findings.heading,
        (*findings.lines, f"Report of {datetime.now(UTC):%Y-%m-%d}"),
        findings.heading,
        findings.opening,
    )
    plots = {f"p{i}": plot for i, plot in enumerate(_plots(findings))}
    words = {"sentences": findings.sentences, "tables": findings.tables}
    save_page(path, assembled(front, [Section("findings", "Result", words, plots)]))


def stacked_findings(findings: Findings) -> Any:
    """The pictures one below the other, as a bokeh layout."""
    from bokeh.layouts import column

    return column(*_plots(findings), sizing_mode="stretch_width")


def _plots(findings: Findings) -> list[Any]:
    return [_drawn(name, *curve) for name, curve in findings.curves.items()]


def _drawn(name: str, x_label: str, y_label: str, lines: Sequence[tuple[str, Array, Array]]) -> Any:
    plot = canvas(x_label, y_label, 300, title=name)
    for (label, x, y), colour in zip(lines, cycle(COLOURS), strict=False):
        kept = extremes([x, y], MOST)
        plot.line(x[kept], y[kept], legend_label=label, line_color=colour, line_width=1.5)
    finish_legend(plot)
    return plot
