"""A recording as one SVG file: every signal over time, events as dashed lines. It needs no browser to be made."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from math import isfinite

import numpy as np

from recordings.arrays import Array
from recordings.recording import Recording
from recordings.signal import Signal
from recordings.views.pictures import envelope, with_gaps

WIDTH, LEFT, RIGHT = 900, 70, 15
"""Of the picture, and of its margins [px]."""

ROW, PLOT = 110, 80
"""Height of a signal's row, and of the plot in it [px]."""

LINE = 16
"""Height of a line of text [px]."""

MOST_POINTS = 1600
MOST_EVENTS = 40
"""Points drawn of one signal, and events drawn at all."""


def drawn(recording: Recording) -> str:
    """The picture as SVG text: one row a signal, the list of events below.

    >>> recording = Recording.from_arrays(time=[0.0, 1.0, 2.0], position=[0.0, 0.01, 0.02])
    >>> drawn(recording).startswith("<svg")
    True
    """
    rows = [signal for signal in recording.signals.values() if signal.role != "time"]
    events = recording.events[:MOST_EVENTS]
    height = LINE * 2 + ROW * len(rows) + LINE * (len(events) + 2)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" '
        'font-family="sans-serif" font-size="11">',
        f'<rect width="{WIDTH}" height="{height}" fill="white"/>',
        _text(LEFT, LINE, recording.title or recording.label, "bold"),
    ]
    start, end = float(recording.time[0]), float(recording.time[-1])
    places = [_across(event.time, start, end) for event in events]
    for row, signal in enumerate(rows):
        parts += _row(signal, recording.time, LINE * 2 + ROW * row, places)
    foot = LINE * 2 + ROW * len(rows)
    parts += [_text(LEFT, foot, f"{start:g} s"), _text(WIDTH - RIGHT, foot, f"{end:g} s", anchor="end")]
    for line, event in enumerate(events, start=2):
        parts.append(_text(LEFT, foot + LINE * line, f"{event.time:.4g} s  {event.kind}: {event.text}"))
    return "\n".join([*parts, "</svg>", ""])


def _row(signal: Signal, time: Array, top: int, events: list[float]) -> Iterator[str]:
    """One signal: frame, events, curve, name and range."""
    there = signal.values[np.isfinite(signal.values)]
    low, high = (float(there.min()), float(there.max())) if len(there) else (0.0, 0.0)
    yield f'<rect x="{LEFT}" y="{top}" width="{WIDTH - LEFT - RIGHT}" height="{PLOT}" fill="none" stroke="#bbb"/>'
    for x in events:
        yield f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{top}" y2="{top + PLOT}" stroke="#b5651d" stroke-dasharray="4 3"/>'
    for points in _curves(*envelope(*with_gaps(time, signal.values), MOST_POINTS), time, (low, high), top):
        yield f'<polyline points="{points}" fill="none" stroke="#1f5fa8"/>'
    yield _text(LEFT + 6, top + 13, signal.spec.label, "bold")
    yield _text(LEFT - 6, top + 10, f"{high:.4g}", anchor="end")
    yield _text(LEFT - 6, top + PLOT, f"{low:.4g}", anchor="end")


def _curves(t: Array, values: Array, time: Array, limits: tuple[float, float], top: int) -> Iterator[str]:
    """The points of each stretch without missing values."""
    low, high = limits
    span = high - low or 1.0
    middle = 0.5 if high == low else 0.0
    points: list[str] = []
    for at, value in zip(t.tolist(), values.tolist(), strict=True):
        if isfinite(value):
            y = top + 4 + (PLOT - 8) * (1.0 - middle - (value - low) / span)
            points.append(f"{_across(at, float(time[0]), float(time[-1])):.1f},{y:.1f}")
        elif points:
            yield " ".join(points)
            points = []
    if points:
        yield " ".join(points)


def _across(at: float, start: float, end: float) -> float:
    """Where a time is in the picture [px]."""
    return LEFT + (WIDTH - LEFT - RIGHT) * min(max((at - start) / (end - start), 0.0), 1.0)


def _text(x: float, y: float, text: str, weight: str = "normal", anchor: str = "start") -> str:
    return f'<text x="{x}" y="{y}" font-weight="{weight}" text-anchor="{anchor}">{escape(text)}</text>'
