"""Measured and simulated signals over time, with the residual and the input below, one block per recording."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.report.canvas import (
    BAND,
    INK,
    MEASURED,
    NARROW,
    RESIDUAL,
    WIDE,
    canvas,
    finish_legend,
    inked,
    robust_range,
    shade,
    unprinted,
)
from identification.report.decimate import extremes
from identification.report.runs import DRAWN, RecordingRun, error_unit, output_name, runs
from identification.report.section import Section
from identification.report.wording.fit_quality import fit_quality
from identification.report.wording.numbers import count, number, plain
from identification.result import FitResult

MOST_POINTS = 60_000
"""Points drawn on the page in this section; a recording gets its share of them, at least `FEWEST_POINTS`."""
FEWEST_POINTS = 3_000
OPEN = 2
"""Blocks that are open at first: the first fitted and the first held-out recording, or the first two."""


def signals(identification: FitResult) -> Section:
    """The section of signals over time."""
    every, quality = runs(identification), fit_quality(identification)
    most, scale = max(MOST_POINTS // len(every), FEWEST_POINTS), error_unit(every)
    first = {role: next((r.place for r in every if r.role == role), 0) for role in ("fitted", "held out")}
    opened = {r.place for r in every} if len(every) <= OPEN else set(first.values())
    words = {
        "output": output_name(every[0]),
        "error_unit": scale[1],
        "blocks": [
            {"run": r, "name": f"signal_{r.place}", "open": r.place in opened} | _facts(r, most, scale) for r in every
        ],
        "window": None if quality.window is None else plain(quality.window),
    }
    plots = {f"signal_{r.place}": _drawn(r, most, scale) for r in every}
    return Section("signals", "Measured and simulated over time", words, plots)


def _facts(run: RecordingRun, most: int, scale: tuple[float, str]) -> dict[str, Any]:
    t, error = run.trajectory.t, run.error[np.isfinite(run.error)]
    n, missing = len(t), int(np.isnan(run.trajectory.measured[np.isfinite(t)]).sum())
    return {
        "samples": count(int(np.isfinite(t).sum())), "duration": number(float(np.nanmax(t) - np.nanmin(t))),
        "rms": number(scale[0] * run.rms), "largest": number(scale[0] * float(np.abs(error).max(initial=0.0))),
        "nrmse": number(100 * run.relative), "over_noise": number(run.over_noise), "missing": missing,
        "stretches": int(np.isnan(t).sum()) + 1, "thinned": n > most,
    }  # fmt: skip


def overlay(identification: FitResult) -> Any:
    """Measured and simulated signal of the first held-out recording, or of the first one where none is held out."""
    every = runs(identification)
    run = next((r for r in every if r.role == "held out"), every[0])
    return _signal(run, _source(run, MOST_POINTS, 1.0), "time [s]")


def _signal(run: RecordingRun, source: Any, x_label: str = "") -> Any:
    """Measured and simulated signal over time."""
    factor, unit = DRAWN[run.trajectory.unit]
    limits = robust_range(factor * run.trajectory.measured, [factor * run.trajectory.simulated])
    plot = canvas(x_label, f"{output_name(run)} [{unit}]", 300, y_range=limits)
    plot.x_range.range_padding = 0.01
    plot.line("t", "measured", source=source, color=MEASURED, line_width=WIDE, legend_label="measured")
    inked(plot.line("t", "simulated", source=source, color=INK, line_width=NARROW, legend_label="simulated"))
    finish_legend(plot)
    return plot


def _drawn(run: RecordingRun, most: int, scale: tuple[float, str]) -> Any:
    """Three plots over one time axis: signal, residual, input."""
    from bokeh.layouts import gridplot

    source, tr = _source(run, most, scale[0]), run.trajectory
    top = _signal(run, source)
    middle, band = canvas("", f"residual [{scale[1]}]", 170, x_range=top.x_range), BAND * scale[0] * tr.noise
    shade(middle, band)
    middle.line("t", "error", source=source, color=RESIDUAL, line_width=1.2)
    driving = "force [N]" if tr.unit == "m" else "position [mm]"
    bottom = canvas("time [s]", driving, 170, x_range=top.x_range)
    bottom.line("t", "input", source=source, color=MEASURED, line_width=1.5)
    plots = [[top], [middle], [bottom]]
    grid = gridplot(plots, sizing_mode="stretch_width", toolbar_location="above", toolbar_options={"logo": None})
    unprinted(grid.toolbar)
    return grid


def _source(run: RecordingRun, most: int, error_factor: float) -> Any:
    """The columns drawn, thinned to about `most` rows; single precision is far finer than a pixel, but not for a long
    recording's clock.
    """
    from bokeh.models import ColumnDataSource

    tr, factor = run.trajectory, DRAWN[run.trajectory.unit][0]
    kept = extremes([tr.measured, tr.simulated, run.error], most)
    columns = {
        "measured": factor * tr.measured,
        "simulated": factor * tr.simulated,
        "error": error_factor * run.error,
        "input": tr.force if tr.unit == "m" else 1e3 * tr.position,
    }
    return ColumnDataSource({"t": tr.t[kept]} | {k: v[kept].astype(np.float32) for k, v in columns.items()})
