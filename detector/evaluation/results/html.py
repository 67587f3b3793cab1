"""One HTML page of an evaluation: its tables, and the course of signals and statistics, drawn by bokeh inside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from detector.evaluation.outcome import Evaluation
from detector.evaluation.results.opening import opening
from detector.evaluation.results.table import ResultTable
from detector.page import whole_page
from simulator.damadics import scenario

if TYPE_CHECKING:
    from bokeh.models import ColumnDataSource
    from bokeh.plotting import figure as Figure

_COLOURS = (
    "#1f4e79", "#d0342c", "#e0701a", "#2a9d5c", "#8a63c4", "#00a0b0", "#b5a300", "#d667a8", "#7a3b1d", "#5c6bc0",
    "#558b2f", "#ad1457", "#00695c", "#8a8f98", "#3e2723",
)  # fmt: skip
_SIGNALS = ("CV", "X", "F")
_OPEN, _DRAWN = 3, 5
"""So many plots are open, and so many detectors drawn in each, before anything is clicked."""

_LOWEST = 0.02
"""Statistics below are not told apart: nothing is near an alarm there."""

_LONG_S = 7200
"""Runs longer than this have their time in hours."""

_ON_PAGE = 400
"""Rows of a table that the page shows; the rest is in the CSV file."""

_FOLDED = ("isolation", "trials")


def page(outcome: Evaluation, made: Sequence[ResultTable]) -> str:
    """The page; it needs no network."""
    from bokeh.embed import components

    drawn = {name: trials[0]["curves"] for name, trials in _main(outcome).items() if "curves" in trials[0]}
    plots = {name: _plot(name, curves) for name, curves in drawn.items()}
    script, places = components(plots) if plots else ("", {})
    sections = [_section(table) for table in made]
    if plots:
        sections.append(f"<h2>Signals and statistics over time</h2><p class='note'>{escape(_caption(outcome))}</p>")
    for number, name in enumerate(plots):
        opened = " open" if number < _OPEN else ""
        sections.append(f"<details{opened}><summary>{escape(scenario(name).text)}</summary>{places[name]}</details>")
    body = "\n".join([opening(outcome), _compared(outcome), *sections])
    return whole_page("Detectors on the benchmark", body, script)


def _main(outcome: Evaluation) -> Mapping[str, Any]:
    return outcome.trials[outcome.plan.variants[0]]


def _compared(outcome: Evaluation) -> str:
    """What the names of the detectors stand for."""
    names = (f"<b>{escape(name)}</b>: {escape(text)}" for name, text in outcome.texts.items())
    return f"<details><summary>The detectors compared</summary><p class='note'>{'<br>'.join(names)}</p></details>"


def _caption(outcome: Evaluation) -> str:
    return (
        f"Seed 1 of {outcome.plan.variants[0]}. Above, the lowest and highest value of set point, position and flow in "
        "each stretch of time; below, the highest statistic of each detector, an alarm above the dashed line. The "
        "dotted line is the onset of the fault; in the grey part no alarm counts. A name in the legend shows or hides "
        "its curve."
    )


def _section(table: ResultTable) -> str:
    heads = "".join(f"<th>{escape(head)}</th>" for head in table.heads)
    rows = "".join("<tr>" + "".join(_cell(cell) for cell in row) + "</tr>" for row in table.rows[:_ON_PAGE])
    left = len(table.rows) - _ON_PAGE
    more = f"<p class='note'>{left} more rows are in {escape(table.name)}.csv.</p>" if left > 0 else ""
    grid = f"<div class='wide'><table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>{more}"
    if table.name in _FOLDED:
        grid = f"<details><summary>{len(table.rows)} rows</summary>{grid}</details>"
    return f"<h2>{escape(table.title)}</h2><p class='note'>{escape(table.note)}</p>{grid}"


def _cell(text: str) -> str:
    return f"<td{' class=long' if len(text) > 60 else ''}>{escape(text)}</td>"


def _plot(name: str, curves: Mapping[str, Any]) -> Any:
    """Signals above, statistics below on a logarithmic scale; the onset and the level of alarms marked."""
    from bokeh.layouts import column
    from bokeh.models import BoxAnnotation, ColumnDataSource, Span
    from bokeh.plotting import figure

    hours = curves["t"][-1] > _LONG_S
    scale, unit = (3600.0, "h") if hours else (1.0, "s")
    source = ColumnDataSource(_columns(curves, scale))
    usual: dict[str, Any] = {"sizing_mode": "stretch_width", "tools": "pan,box_zoom,wheel_zoom,reset,save"}
    top = figure(height=230, y_axis_label="share of span", **usual)
    below = figure(
        height=370, x_range=top.x_range, y_range=_range(curves), y_axis_type="log", x_axis_label=f"time [{unit}]",
        y_axis_label="statistic, alarm above 1", **usual,
    )  # fmt: skip
    _signals(top, source)
    _statistics(below, source, tuple(curves["statistics"]))
    below.add_layout(Span(location=1.0, dimension="width", line_dash="dashed", line_color="#1c2127"))
    for plot in (top, below):
        onset, started = scenario(name).faults[0].start_s / scale, scenario(name).ton / scale
        plot.add_layout(BoxAnnotation(right=started, fill_color="#8a8f98", fill_alpha=0.15, line_color=None))
        plot.add_layout(Span(location=onset, dimension="height", line_color="#d0342c", line_dash="dotted"))
        plot.add_layout(plot.legend[0], "above")
        plot.legend.update(click_policy="hide", orientation="horizontal", ncols=8, label_text_font_size="11px",
                           margin=0, padding=2, border_line_color=None)  # fmt: skip
        plot.toolbar.logo, plot.min_border_left = None, 60
    return column(top, below, sizing_mode="stretch_width")


def _range(curves: Mapping[str, Any]) -> tuple[float, float]:
    """Two decades below the level of an alarm, and up to the highest statistic."""
    highest = max(max(values) for values in curves["statistics"].values())
    return _LOWEST, 2 * max(highest, 5.0)


def _columns(curves: Mapping[str, Any], scale: float) -> dict[str, Any]:
    """Single precision: what a screen shows, at a quarter of the size of text."""
    columns = {"t": np.array(curves["t"]) / scale}
    for signal in _SIGNALS:
        columns |= {f"{signal} {end}": np.array(curves[signal][end]) for end in ("low", "high")}
    columns |= {name: np.array(values) for name, values in curves["statistics"].items()}
    return {name: values.astype(np.float32) for name, values in columns.items()}


def _signals(plot: Figure, source: ColumnDataSource) -> None:
    for colour, signal in zip(_COLOURS, _SIGNALS, strict=False):
        look = {"color": colour, "legend_label": signal, "source": source}
        plot.varea("t", f"{signal} low", f"{signal} high", alpha=0.25, **look)
        for end in ("low", "high"):
            plot.line("t", f"{signal} {end}", line_width=1, **look)


def _statistics(plot: Figure, source: ColumnDataSource, detectors: Sequence[str]) -> None:
    for number, detector in enumerate(detectors):
        colour = _COLOURS[number % len(_COLOURS)]
        line = plot.line("t", detector, color=colour, legend_label=detector, source=source)
        line.visible = number < _DRAWN
