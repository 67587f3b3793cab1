"""A recording as one self-contained HTML page: every signal over time, and the loop of force and position."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import numpy as np

from recordings.arrays import Array
from recordings.description import GAP_STEPS, describe
from recordings.hdf5.reader import read
from recordings.recording import Recording
from recordings.signal import Signal

_MOST_POINTS = 4000
"""Points drawn of one signal; more would not be seen and would make the page heavy."""


def picture(path: str | Path) -> str:
    """The page of a recording, with everything inside that a browser needs; `BadInput` when it is not valid."""
    from bokeh.embed import file_html
    from bokeh.layouts import column
    from bokeh.models import Div
    from bokeh.resources import INLINE

    recording = read(path)
    words = Div(text=f"<pre>{html.escape(describe(path))}</pre>")
    parts = [words, *_over_time(recording), *_loop(recording)]
    title = recording.title or Path(path).name
    return file_html(column(*parts, sizing_mode="stretch_width"), INLINE, title=title)


def _over_time(recording: Recording) -> list[Any]:
    """One plot a signal, all with one axis of time; events are dashed lines."""
    from bokeh.models import Span
    from bokeh.plotting import figure

    plots: list[Any] = []
    for signal in recording.signals.values():
        if signal.role == "time":
            continue
        shared = {"x_range": plots[0].x_range} if plots else {}
        plot = figure(height=190, y_axis_label=signal.spec.label, sizing_mode="stretch_width", **shared)
        plot.line(*envelope(*with_gaps(recording.time, signal.values)))
        for event in recording.events[:200]:
            plot.add_layout(Span(location=event.time, dimension="height", line_dash="dashed", line_color="gray"))
        plots.append(plot)
    if plots:
        plots[-1].xaxis.axis_label = "time [s]"
    return plots


def _loop(recording: Recording) -> list[Any]:
    """The signature engineers know: force, or pressure, over position."""
    from bokeh.plotting import figure

    across = recording.signals.get("force") or recording.signals.get("pressure")
    position = recording.signals.get("position")
    if across is None or position is None:
        return []
    plot = figure(height=420, x_axis_label=position.spec.label, y_axis_label=across.spec.label, max_width=700)
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
