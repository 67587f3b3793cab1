"""The figures of a valve in service as a table: each with its interval and where it goes."""

from __future__ import annotations

from dataclasses import dataclass

from hil.page.views.words import NARROW, NOTHING, lasting, number, quantity
from hil.service.in_service.figures import InServiceFigures, Trended

NAMED = (
    ("friction", "friction"), ("spring_rate", "spring rate"), ("dead_band", "dead band"), ("dead_time", "dead time Td"),
    ("t86", "T86"), ("overshoot", "overshoot"),
)  # fmt: skip


@dataclass(frozen=True)
class FigureRow:
    """A figure in words. trend : its change in a day, a dash where it is not known yet."""

    name: str
    value: str
    interval: str
    trend: str


def figure_rows(figures: InServiceFigures | None) -> list[FigureRow]:
    """The table; empty before the first update."""
    if figures is None:
        return []
    counted = [
        FigureRow("watched for", lasting(figures.observed_s), "", ""),
        FigureRow("travel", quantity(figures.travelled_strokes, "strokes"), "", ""),
        FigureRow("reversals", f"{figures.reversals}", "", ""),
        FigureRow("steps judged", f"{figures.steps}", "", ""),
    ]
    return [_row(words, getattr(figures, name)) for name, words in NAMED] + counted


def _row(words: str, found: Trended | None) -> FigureRow:
    if found is None:
        return FigureRow(words, NOTHING, "", NOTHING)
    now, trend = found.now, found.per_day
    interval = f"{number(now.lower)} to {number(now.upper)}{NARROW}{found.unit}"
    said = NOTHING
    if trend is not None:
        sure = "" if trend.lower > 0.0 or trend.upper < 0.0 else ", may be none"
        said = f"{'+' if trend.value > 0 else ''}{quantity(trend.value, found.unit, 2)} a day{sure}"
    return FigureRow(words, quantity(now.value, found.unit), interval, said)
