"""The story of a trace, told before the sections of the fit: what was left, what was tried, what it changed."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from identification.report.assembly import assembled, save_page
from identification.report.fit_page import SECTIONS, front
from identification.report.section import Section
from identification.tracing.models.model import Model
from identification.tracing.residual import quantities
from identification.tracing.result import Trace

POINTS, SHOWN = 2000, 400
"""Points of a picture, and frequencies of a spectrum, at most."""


def write_trace_report(path: str | os.PathLike[str], trace: Trace) -> None:
    """Write the report of a trace as one self-contained HTML file. Raises BadInput when it cannot be written."""
    sections = [story(trace), *(section(trace.final) for section in SECTIONS)]
    save_page(path, assembled(front("Valve trace", trace.final), sections))


def story(trace: Trace) -> Section:
    """The section that says what was traced."""
    error, unit = trace.error, trace.unit
    words: dict[str, Any] = {
        "verdict": trace.verdict, "sentences": trace.sentences(),
        "candidates": [
            {"effect": c.effect, "gain": f"{c.gain:.4g}", "t": "" if c.held_out is None else f"{c.held_out.t:.1f}",
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
    """What had to be added to the force, before and after, over everything an engineer would plot it over."""
    from bokeh.plotting import figure

    models = [(trace.selection.base, "#c0504d", "before"), (trace.selection.final, "#2f6db3", "after")]
    known = [quantities(model) for model, _, _ in models]
    plots = {}
    for name, first in known[0].items():
        plot = figure(
            height=240, sizing_mode="stretch_width", x_axis_label=f"{name} [{first.unit}]",
            y_axis_label="force left [N]",
        )  # fmt: skip
        for (model, colour, legend), mine in zip(models, known, strict=True):
            force = np.concatenate(model.residual_force)
            step = max(1, len(force) // POINTS)
            values = mine[name].values[::step]
            plot.scatter(values, force[::step], size=2, color=colour, alpha=0.4, legend_label=legend)
        plot.legend.click_policy = "hide"
        plots[name.replace(" ", "_")] = plot
    plots["frequency"] = _spectrum(models)
    return plots


def _spectrum(models: list[tuple[Model, str, str]]) -> Any:
    """Amplitudes of the force left over frequency, of the longest recording."""
    from bokeh.plotting import figure

    plot = figure(
        height=240, sizing_mode="stretch_width", x_axis_label="frequency [Hz]", y_axis_label="amplitude [N]",
        x_axis_type="log",
    )  # fmt: skip
    for model, colour, legend in models:
        segment, force = max(zip(model.data.fitted, model.residual_force, strict=True), key=lambda pair: pair[0].t[-1])
        grid = np.linspace(segment.t[0], segment.t[-1], len(segment.t))
        window = np.hanning(len(grid))
        amplitude = 2 * np.abs(np.fft.rfft(np.interp(grid, segment.t, force) * window)) / window.sum()
        f = np.fft.rfftfreq(len(grid), grid[1] - grid[0])
        edges = np.geomspace(f[1], f[-1], SHOWN + 1)
        place = np.digitize(f[1:], edges)
        shown = [(f[1:][place == i].mean(), amplitude[1:][place == i].max()) for i in np.unique(place)]
        plot.line(*zip(*shown, strict=True), color=colour, legend_label=legend)
    return plot
