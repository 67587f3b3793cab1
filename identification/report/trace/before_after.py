"""A held-out recording, the model before and the model after, drawn over each other; their errors below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.report.canvas import (
    BAND,
    BEFORE,
    INK,
    MEASURED,
    NARROW,
    WIDE,
    canvas,
    finish_legend,
    inked,
    robust_range,
    shade,
    unprinted,
)
from identification.report.decimate import extremes
from identification.report.runs import DRAWN, RecordingRun, error_unit, output_name, rms, runs
from identification.result import Trajectory
from identification.tracing.result import TraceResult
from recordings import Array

MOST_POINTS = 20_000
CLOSE = 0.1
"""Length of the close view, in lengths of the recording."""


@dataclass(frozen=True)
class BeforeAfter:
    """One recording with the free runs of the model before and after; `after` is None where nothing was added.
    scale : factor and unit of the errors.
    """

    role: str
    before: RecordingRun
    after: RecordingRun | None
    scale: tuple[float, str]

    @property
    def name(self) -> str:
        """What the recording is called."""
        return self.before.trajectory.name


def before_after(trace: TraceResult) -> BeforeAfter:
    """The held-out recording on which the model before misses most; a fitted one where none is held out."""
    held = bool(trace.base.holdout)
    pairs = list(
        zip(trace.base.holdout, trace.final.holdout, strict=True)
        if held
        else zip(trace.base.trajectories, trace.final.trajectories, strict=True)
    )
    worst = max(range(len(pairs)), key=lambda i: np.nan_to_num(_missed(pairs[i][0]), nan=np.inf))
    first, last = (RecordingRun(t, worst + 1, "held out" if held else "fitted") for t in pairs[worst])
    return BeforeAfter(first.role, first, last if trace.effects_added else None, error_unit(runs(trace.final)))


def _missed(run: Trajectory) -> float:
    return rms(run.measured - run.simulated)


def overlay(shown: BeforeAfter) -> Any:
    """Measured signal and both models over time."""
    run, factor = shown.before.trajectory, DRAWN[shown.before.trajectory.unit][0]
    curves = _curves(shown)
    kept = extremes([run.measured, *(one.trajectory.simulated for one, _, _ in curves)], MOST_POINTS)
    limits = robust_range(factor * run.measured, [factor * one.trajectory.simulated for one, _, _ in curves])
    plot = canvas("time [s]", f"{output_name(shown.before)} [{DRAWN[run.unit][1]}]", 300, y_range=limits)
    plot.x_range.range_padding = 0.01
    t = run.t[kept]
    plot.line(t, _drawn(factor * run.measured, kept), color=MEASURED, line_width=WIDE, legend_label="measured")
    for one, colour, name in curves:
        line = plot.line(t, _drawn(factor * one.trajectory.simulated, kept), color=colour,
                         line_width=NARROW, legend_label=name)  # fmt: skip
        if colour == INK:
            inked(line)
    finish_legend(plot)
    return plot


def stacked(shown: BeforeAfter) -> Any:
    """Signals and errors over one time axis."""
    from bokeh.layouts import gridplot

    signal, error = overlay(shown), errors(shown)
    error.x_range, signal.xaxis.axis_label = signal.x_range, ""
    error.legend.visible = False
    grid = gridplot(
        [[signal], [error]], sizing_mode="stretch_width", toolbar_location="above", toolbar_options={"logo": None}
    )
    unprinted(grid.toolbar)
    return grid


def close_view(shown: BeforeAfter) -> Any:
    """Signals in the part of the recording in which the models differ most."""
    plot = overlay(shown)
    run = shown.before.trajectory
    other = run.measured if shown.after is None else shown.after.trajectory.simulated
    t, missed = run.t, np.nan_to_num((run.simulated - other) ** 2)
    width = max(int(CLOSE * len(t)), 2)
    total = np.concatenate([[0.0], np.cumsum(missed)])
    first = int(np.argmax(total[width:] - total[:-width]))
    part = slice(first, first + width)
    plot.x_range.start, plot.x_range.end = float(np.nanmin(t[part])), float(np.nanmax(t[part]))
    every = [run.measured[part], *(one.trajectory.simulated[part] for one, _, _ in _curves(shown))]
    factor = DRAWN[run.unit][0]
    low, high = robust_range(factor * every[0], [factor * one for one in every[1:]])
    plot.y_range.start, plot.y_range.end = low, high
    return plot


def errors(shown: BeforeAfter) -> Any:
    """The errors of both models over time, with the band of the noise."""
    run, (factor, unit) = shown.before.trajectory, shown.scale
    curves = _curves(shown)
    kept = extremes([one.error for one, _, _ in curves], MOST_POINTS)
    band = BAND * factor * run.noise
    most = factor * float(np.ptp(run.measured[np.isfinite(run.measured)])) / (2 * band or 1.0)
    limits = robust_range(np.array([-band, band]), [factor * one.error for one, _, _ in curves], most)
    plot = canvas("time [s]", f"measured − model [{unit}]", 230, y_range=limits)
    plot.x_range.range_padding = 0.01
    shade(plot, band)
    for one, colour, name in curves:
        line = plot.line(run.t[kept], _drawn(factor * one.error, kept), color=colour, line_width=1, legend_label=name)
        if colour == INK:
            inked(line)
    finish_legend(plot)
    return plot


def _curves(shown: BeforeAfter) -> list[tuple[RecordingRun, str, str]]:
    """What is drawn beside the measured signal: run, colour, name."""
    if shown.after is None:
        return [(shown.before, INK, "model")]
    return [(shown.before, BEFORE, "model before"), (shown.after, INK, "model after")]


def _drawn(values: Array, kept: Any) -> Array:
    """Single precision is far finer than a pixel."""
    return np.asarray(values[kept], np.float32)
