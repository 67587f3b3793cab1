"""The figures of a valve in service: a table, each with its interval and where it goes, and three small drawings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hil.page.views.words import NARROW, NOTHING, lasting, number, quantity
from hil.service.in_service.figures import Histogram, InServiceFigures, SignatureCurve, Trended

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


WIDTH, HEIGHT = 300.0, 80.0
"""Of a small drawing, in its own units."""


@dataclass(frozen=True)
class HistogramDrawing:
    """A histogram as bars (left, top, width, height). first, last : ends of its scale, in words."""

    words: str
    bars: tuple[tuple[float, float, float, float], ...]
    first: str
    last: str


@dataclass(frozen=True)
class SignatureDrawing:
    """A signature as points of two lines. low, high : ends of the scale of its input, in words."""

    up: str
    down: str
    low: str
    high: str


def histograms(figures: InServiceFigures) -> list[HistogramDrawing]:
    """Where the valve was, and how far it moved."""
    both = (("time spent at positions", figures.travel), ("movements by their length", figures.cycles))
    return [_histogram(words, found) for words, found in both if any(count > 0 for count in found.counts)]


def signature(curve: SignatureCurve | None) -> SignatureDrawing | None:
    """Input over travel, upwards and downwards; None where there is none."""
    if curve is None or len(curve.place) < 2:
        return None
    known = [value for value in (*curve.up, *curve.down) if math.isfinite(value)]
    if not known:
        return None
    low, high = min(known), max(known)

    def line(values: Sequence[float]) -> str:
        span = (high - low) or 1.0
        points = zip(curve.place, values, strict=True)
        return " ".join(
            f"{WIDTH * place / 100.0:.1f},{HEIGHT * (1.0 - (value - low) / span):.1f}"
            for place, value in points
            if math.isfinite(value)
        )

    return SignatureDrawing(line(curve.up), line(curve.down), quantity(low, curve.unit), quantity(high, curve.unit))


def _histogram(words: str, found: Histogram) -> HistogramDrawing:
    first, last, most = found.edges[0], found.edges[-1], max(found.counts)
    scale = WIDTH / ((last - first) or 1.0)
    bars = tuple(
        (scale * (left - first), HEIGHT * (1.0 - count / most), scale * (right - left), HEIGHT * count / most)
        for left, right, count in zip(found.edges[:-1], found.edges[1:], found.counts, strict=True)
    )
    return HistogramDrawing(words, bars, quantity(first, found.unit), quantity(last, found.unit))


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
