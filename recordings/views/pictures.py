"""A recording as pictures, every signal over time and the loop of force and position, and as a table for a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any, Protocol

import numpy as np

from recordings.arrays import Array
from recordings.plant import Event
from recordings.signal import Signal

GAP_STEPS = 5
"""A step of time longer than this many median steps is called a gap."""

_MOST_POINTS = 4000
"""Points drawn of one signal; more would not be seen and would make the page heavy."""


class DrawnRecording(Protocol):
    """What is drawn of a recording: see `Recording`."""

    @property
    def time(self) -> Array: ...
    @property
    def signals(self) -> Mapping[str, Signal]: ...
    @property
    def events(self) -> Sequence[Event]: ...


def picture_of(recording: DrawnRecording) -> Any:
    """The pictures of `plots`, one below the other, as a bokeh layout."""
    from bokeh.layouts import column

    return column(*plots(recording), sizing_mode="stretch_width")


def table(recording: DrawnRecording) -> str:
    """What each signal is, and from where to where it goes, as an HTML table."""
    heads = "".join(f"<th>{word}</th>" for word in ("signal", "role", "unit", "from", "to", "missing"))
    rows = "".join(
        f"<tr>{''.join(f'<td>{escape(word)}</td>' for word in _row(signal))}</tr>"
        for signal in recording.signals.values()
    )
    caption = escape(repr(recording).strip("<>"))
    return f"<table><caption>{caption}</caption><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"


def _row(signal: Signal) -> Sequence[str]:
    there = signal.values[np.isfinite(signal.values)]
    span = (f"{there.min():.5g}", f"{there.max():.5g}") if len(there) else ("", "")
    return signal.name, signal.role, signal.unit, *span, str(len(signal) - len(there) or "-")


def plots(recording: DrawnRecording) -> list[Any]:
    """Every signal over time, and the loop where there is one, as bokeh figures."""
    return [*_over_time(recording), *_loop(recording)]


def _over_time(recording: DrawnRecording) -> list[Any]:
    """One plot a signal, all with one axis of time; events are dashed lines."""
    from bokeh.models import PlainText, Span
    from bokeh.plotting import figure

    plots: list[Any] = []
    for signal in recording.signals.values():
        if signal.role == "time":
            continue
        shared = {"x_range": plots[0].x_range} if plots else {}
        plot = figure(height=190, y_axis_label=PlainText(signal.spec.label), sizing_mode="stretch_width", **shared)
        plot.line(*envelope(*with_gaps(recording.time, signal.values)))
        for event in recording.events[:200]:
            plot.add_layout(Span(location=event.time, dimension="height", line_dash="dashed", line_color="gray"))
        plots.append(plot)
    if plots:
        plots[-1].xaxis.axis_label = "time [s]"
    return plots


def _loop(recording: DrawnRecording) -> list[Any]:
    """The signature engineers know: force, or pressure, over position."""
    from bokeh.models import PlainText
    from bokeh.plotting import figure

    across = recording.signals.get("force") or recording.signals.get("pressure")
    position = recording.signals.get("position")
    if across is None or position is None:
        return []
    labels = (PlainText(one.spec.label) for one in (position, across))  # not to be read as mathematics
    plot = figure(height=420, **dict(zip(("x_axis_label", "y_axis_label"), labels, strict=True)), max_width=700)
    plot.line(*_thinned(position, across), line_alpha=0.6)
    return [plot]


def _thinned(first: Signal, second: Signal) -> tuple[Array, Array]:
    every = -(-len(first) // (5 * _MOST_POINTS))
    return first.values[::every], second.values[::every]


def with_gaps(time: Array, values: Array) -> tuple[Array, Array]:
    """The curve with a missing value in every gap, so that no line is drawn across it; shape (n_samples,) each."""
    steps = np.diff(time)
    after = np.flatnonzero(steps > GAP_STEPS * np.median(steps)) + 1
    return np.insert(time, after, time[after - 1]), np.insert(values, after, np.nan)


def envelope(time: Array, values: Array, most: int = _MOST_POINTS) -> tuple[Array, Array]:
    """At most `most` points that look the same: the lowest and highest value of each stretch. No peak is lost.

    >>> envelope(np.arange(8.0), np.array([0.0, 9.0, 0.0, 0.0, 0.0, 0.0, -9.0, 0.0]), most=4)[1]
    array([ 0.,  9., -9.,  0.])
    """
    if len(time) <= most:
        return time, values
    stretch = -(-len(time) // (most // 2))
    n_stretches = -(-len(time) // stretch)
    padded = np.full(n_stretches * stretch, np.nan)
    padded[: len(values)] = values
    blocks = padded.reshape(n_stretches, stretch)
    starts = np.arange(n_stretches) * stretch
    ends = np.minimum(starts + stretch, len(time)) - 1
    low, high = np.fmin.reduce(blocks, axis=1), np.fmax.reduce(blocks, axis=1)
    rises = values[starts] <= values[ends]  # in this order a steady slope stays a line
    pairs: Array = np.column_stack((np.where(rises, low, high), np.where(rises, high, low)))
    times: Array = np.column_stack((time[starts], time[ends])).ravel()
    return times, pairs.ravel()
