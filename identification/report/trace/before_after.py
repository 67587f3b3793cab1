"""A held-out recording, the model before and the model after, drawn over each other; their errors below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.report.canvas import (
    BEFORE,
    INK,
    MEASURED,
    NARROW,
    NEUTRAL,
    WIDE,
    canvas,
    finish_legend,
    inked,
    robust_range,
)
from identification.report.decimate import extremes
from identification.report.runs import DRAWN, Run, error_unit, output_name, rms
from identification.result import Trajectory
from identification.tracing.result import Trace
from recordings import Array

MOST_POINTS = 20_000
BAND = 2.576
"""Half width of the band that holds 99 % of the noise, in standard deviations."""
FAR = 50.0
"""The errors are drawn up to this many widths of that band."""


@dataclass(frozen=True)
class BeforeAfter:
    """One recording with the free runs of the model before and after; `after` is None where nothing was added."""

    role: str
    before: Run
    after: Run | None

    @property
    def name(self) -> str:
        """What the recording is called."""
        return self.before.trajectory.name

    @property
    def unit(self) -> tuple[float, str]:
        """Factor and unit of the errors."""
        return error_unit(tuple(r for r in (self.before, self.after) if r is not None))


def before_after(trace: Trace) -> BeforeAfter:
    """The held-out recording on which the model before misses most; a fitted one where none is held out."""
    held = bool(trace.base.holdout)
    pairs = list(
        zip(trace.base.holdout, trace.final.holdout, strict=True)
        if held
        else zip(trace.base.trajectories, trace.final.trajectories, strict=True)
    )
    worst = max(range(len(pairs)), key=lambda i: np.nan_to_num(_missed(pairs[i][0]), nan=np.inf))
    first, last = (Run(t, worst + 1, "held out" if held else "fitted") for t in pairs[worst])
    return BeforeAfter(first.role, first, last if trace.effects_added else None)


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


def errors(shown: BeforeAfter) -> Any:
    """The errors of both models over time, with the band of the noise."""
    from bokeh.models import BoxAnnotation

    run, (factor, unit) = shown.before.trajectory, shown.unit
    curves = _curves(shown)
    kept = extremes([one.error for one, _, _ in curves], MOST_POINTS)
    band = BAND * factor * run.noise
    limits = robust_range(np.array([-band, band]), [factor * one.error for one, _, _ in curves], FAR)
    plot = canvas("time [s]", f"measured − model [{unit}]", 220, y_range=limits)
    plot.x_range.range_padding = 0.01
    plot.add_layout(BoxAnnotation(bottom=-band, top=band, fill_color=NEUTRAL, fill_alpha=0.25, line_color=None))
    for one, colour, name in curves:
        line = plot.line(run.t[kept], _drawn(factor * one.error, kept), color=colour, line_width=1, legend_label=name)
        if colour == INK:
            inked(line)
    finish_legend(plot)
    return plot


def _curves(shown: BeforeAfter) -> list[tuple[Run, str, str]]:
    """What is drawn beside the measured signal: run, colour, name."""
    if shown.after is None:
        return [(shown.before, INK, "model")]
    return [(shown.before, BEFORE, "model before"), (shown.after, INK, "model after")]


def _drawn(values: Array, kept: Any) -> Array:
    """Single precision is far finer than a pixel."""
    return np.asarray(values[kept], np.float32)
