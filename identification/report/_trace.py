"""The story of a trace, told before the sections of the fit: what was left, what was tried, what it changed."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification._trace_model import Model
from identification._trace_result import Trace
from identification.report._page import write_report
from identification.report._section import Section

Array = NDArray[np.float64]

POINTS = 4000
"""Points of a picture at most."""


def write_trace_report(path: str | os.PathLike[str], trace: Trace) -> None:
    """Write the report of a trace as one self-contained HTML file. Raises BadInput when it cannot be written."""
    write_report(path, trace.final, [story(trace)])


def story(trace: Trace) -> Section:
    """The section that says what was traced."""
    error, unit = trace.error, trace.unit
    words: dict[str, Any] = {
        "verdict": trace.verdict, "sentences": trace.sentences(),
        "candidates": [
            {"effect": c.effect, "gain": f"{c.gain:.4g}", "t": "" if c.held is None else f"{c.held.t:.1f}",
             "rmse": _sized(trace.holdout_rmse.get(c.effect), unit), "why": c.why}
            for c in trace.candidates
        ],
        "errors": [
            {"side": side, "fit": _sized((error[side]["fit"] or {}).get(f"rmse_{unit}"), unit),
             "holdout": _sized((error[side]["holdout"] or {}).get(f"rmse_{unit}"), unit)}
            for side in ("before", "after")
        ],
        "floor": _sized(error[f"noise_floor_{unit}"], unit), "unit": "N" if unit == "N" else "µm",
    }  # fmt: skip
    return Section("trace", "What the model lacked", words, _pictures(trace))


def _sized(error: float | None, unit: str) -> str:
    """An error in N, or in micrometres."""
    return "" if error is None else f"{error if unit == 'N' else 1e6 * error:.3g}"


def _pictures(trace: Trace) -> dict[str, Any]:
    """What had to be added to the force, before and after, against position, velocity and time."""
    from bokeh.plotting import figure

    plots = {}
    axes = {"position": (0, "position [m]"), "velocity": (1, "velocity [m/s]")}
    for name, (column, label) in axes.items():
        plot = figure(height=300, sizing_mode="stretch_width", x_axis_label=label, y_axis_label="force left [N]")
        for model, colour, legend in (
            (trace.tracing.base, "#c0504d", "before"), (trace.tracing.final, "#2f6db3", "after")
        ):  # fmt: skip
            x, force = _left(model, column)
            plot.scatter(x, force, size=2, color=colour, alpha=0.4, legend_label=legend)
        plot.legend.click_policy = "hide"
        plots[name] = plot
    return plots


def _left(model: Model, column: int) -> tuple[Array, Array]:
    x = np.concatenate([p[:, column] for p in model.estimate.paths])
    force = np.concatenate(model.force_left)
    step = max(1, len(x) // POINTS)
    return x[::step], force[::step]
