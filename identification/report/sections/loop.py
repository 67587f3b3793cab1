"""The force-position loop: the valve signature, measured and simulated, with the spring line and the friction band."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.report.canvas import INK, MEASURED, NARROW, REFERENCE, WIDE, canvas, dress, finish_legend, inked
from identification.report.decimate import extremes
from identification.report.runs import RecordingRun, runs
from identification.report.section import Section
from identification.report.wording.key_figures import KeyFigures, key_figures
from identification.report.wording.numbers import number
from identification.result import FitResult

MOST_POINTS = 60_000
LABELLED = 6
"""Recordings with an entry of their own in the legend."""


def loop(identification: FitResult) -> Section:
    """The section of the valve signature."""
    figures, every = key_figures(identification), runs(identification)
    words = {
        "motion": every[0].trajectory.unit == "N",
        "spring": figures.rate is not None,
        "width": None if figures.friction is None else number(2 * figures.friction),
        "pressure": figures.area is not None,
        "slope": number(figures.rate / 1e3) if figures.rate else None,
    }
    return Section("loop", "Valve signature: force against position", words, {"loop": _drawn(every, figures)})


def _drawn(every: tuple[RecordingRun, ...], figures: KeyFigures) -> Any:
    plot = canvas("position [mm]", "actuator force [N]", 460)
    most = max(MOST_POINTS // len(every), 2000)
    for run in every:
        _add(plot, run, most, labelled=1 < len(every) <= LABELLED)
    if figures.rate is not None and figures.preload is not None:
        _add_spring(plot, every, figures)
    if figures.area:
        _add_pressure_axis(plot, every, figures.area)
    finish_legend(plot)
    return plot


def _add(plot: Any, run: RecordingRun, most: int, *, labelled: bool) -> None:
    tr = run.trajectory
    driven = tr.unit == "m"
    kept = extremes([tr.measured, tr.simulated, tr.force if driven else tr.position], most)
    measured = (1e3 * tr.measured, tr.force) if driven else (1e3 * tr.position, tr.measured)
    simulated = (1e3 * tr.simulated, tr.force) if driven else (1e3 * tr.position, tr.simulated)
    suffix = f" {run.place}" if labelled else ""
    for (x, y), colour, width, name in ((measured, MEASURED, WIDE, "measured"), (simulated, INK, NARROW, "simulated")):
        x, y = x[kept].astype(np.float32), y[kept].astype(np.float32)
        line = plot.line(x, y, color=colour, line_width=width, legend_label=name + suffix)
        if colour == INK:
            inked(line)


def _add_spring(plot: Any, every: tuple[RecordingRun, ...], f: KeyFigures) -> None:
    """The line K x + F0 and the two lines a friction level above and below it, on which slow strokes run."""
    low, high = _extent([r.trajectory.position for r in every])
    x = np.array([low, high])
    line = (f.rate or 0.0) * x + (f.preload or 0.0)
    plot.line(1e3 * x, line, color=REFERENCE, line_width=1.5, legend_label="spring")
    for sign in (-1, 1) if f.friction else ():
        level = line + sign * (f.friction or 0.0)
        plot.line(1e3 * x, level, color=REFERENCE, line_width=1.5, line_dash="dashed", legend_label="spring ± friction")


def _add_pressure_axis(plot: Any, every: tuple[RecordingRun, ...], area: float) -> None:
    """A second axis with the actuator pressure; both ranges are set, so that they stay in step while zooming."""
    from bokeh.models import LinearAxis, Range1d

    low, high = _extent([r.actuator_force for r in every])
    margin = 0.06 * (high - low) or 1.0
    plot.y_range = Range1d(low - margin, high + margin)
    plot.extra_y_ranges = {"pressure": Range1d((low - margin) / area / 1e3, (high + margin) / area / 1e3)}
    axis = LinearAxis(y_range_name="pressure", axis_label="actuator pressure [kPa]")
    dress(axis)
    plot.add_layout(axis, "right")


def _extent(arrays: list[Any]) -> tuple[float, float]:
    return min(float(np.nanmin(a)) for a in arrays), max(float(np.nanmax(a)) for a in arrays)
