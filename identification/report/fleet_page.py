"""The page of a fleet: who leads each ranking, how the valves are distributed, and the way to each valve's own page."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.report.assembly import Front, assembled, save_page
from identification.report.canvas import ALARM, MEASURED, canvas
from identification.report.section import Section
from recordings import Array, ReportOpening


@dataclass(frozen=True)
class Cell:
    """A cell of a table. href : a page that it leads to, relative to this one; empty for none."""

    text: str
    href: str = ""


@dataclass(frozen=True)
class FleetTable:
    """A table. head : of the columns; rows : of cells."""

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Distribution:
    """How a quantity is distributed over the valves. values : (n,), NaN left out; told : the outliers, (n,)."""

    label: str
    values: Array
    told: NDArray[np.bool_]
    logarithmic: bool


@dataclass(frozen=True)
class FleetSection:
    """A section of the page: a title, sentences, perhaps a table, and distributions."""

    title: str
    sentences: Sequence[str] = ()
    table: FleetTable | None = None
    distributions: Sequence[Distribution] = ()


def write_fleet_report(
    path: str | os.PathLike[str], heading: str, opening: ReportOpening, sections: Sequence[FleetSection]
) -> None:
    """Write the page as one HTML file that needs no network. Raises BadInput when the path cannot be written."""
    front = Front("Fleet", heading, (f"Report of {datetime.now(UTC):%Y-%m-%d}",), heading, opening)
    save_page(path, assembled(front, [_section(number, one) for number, one in enumerate(sections)]))


def _section(number: int, section: FleetSection) -> Section:
    plots = {f"d{i}": _drawn(one) for i, one in enumerate(section.distributions)}
    words = {"sentences": section.sentences, "table": section.table}
    return Section(f"fleet-{number}", section.title, words, plots, template="fleet")


def _drawn(what: Distribution) -> Any:
    """A histogram, outliers in the colour of an alarm and as marks on the axis: not by colour alone."""
    known = np.isfinite(what.values)
    values, told = what.values[known], what.told[known]
    options = {"x_axis_type": "log"} if what.logarithmic else {}
    plot = canvas(what.label, "valves", 200, **options)
    scale = np.log10(values) if what.logarithmic else values
    margin = 0.01 * np.ptp(scale) or 0.01 * max(float(np.abs(scale).max()), 1e-9)  # values may all be equal
    bins = min(max(round(np.sqrt(len(scale))), 4), 40)
    edges = np.linspace(scale.min() - margin, scale.max() + margin, bins + 1)
    ends = 10.0**edges if what.logarithmic else edges
    sound, odd = (np.histogram(scale[chosen], edges)[0] for chosen in (~told, told))
    plot.quad(left=ends[:-1], right=ends[1:], bottom=0, top=sound, fill_color=MEASURED, line_color="white")
    plot.quad(left=ends[:-1], right=ends[1:], bottom=sound, top=sound + odd, fill_color=ALARM, line_color="white")
    plot.scatter(values[told], np.zeros(told.sum()), marker="inverted_triangle", size=10, color=ALARM)
    return plot
