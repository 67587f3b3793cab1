"""One HTML page of an evaluation: its tables, and the course of signals and statistics, drawn by bokeh inside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from detector.evaluation._study import Outcome
from detector.evaluation._tables import Table
from simulator.damadics import scenario

_COLOURS = (
    "#1f4e79",
    "#d0342c",
    "#e0701a",
    "#2a9d5c",
    "#8a63c4",
    "#8a8f98",
    "#b5a300",
    "#00a0b0",
    "#7a3b1d",
    "#d667a8",
)
_OPEN = 3
_ON_PAGE = 400
"""Rows of a table that the page shows; the rest is in the CSV file."""

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; color: #1c2127; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
td, th { padding: 2px 8px; border-bottom: 1px solid #d5d9df; text-align: left; white-space: nowrap; }
.wide { overflow-x: auto; } .note { max-width: 60rem; color: #4a525c; } summary { cursor: pointer; padding: 4px 0; }
"""


def page(outcome: Outcome, made: Sequence[Table]) -> str:
    """The page; it needs no network."""
    from bokeh.embed import components
    from bokeh.resources import Resources

    drawn = {name: trials[0]["curves"] for name, trials in _main(outcome).items() if "curves" in trials[0]}
    plots = {name: _plot(name, curves) for name, curves in drawn.items()}
    script, places = components(plots) if plots else ("", {})
    sections = [_section(table) for table in made]
    for number, name in enumerate(plots):
        opened = " open" if number < _OPEN else ""
        sections.append(f"<details{opened}><summary>{escape(scenario(name).text)}</summary>{places[name]}</details>")
    head = f"<meta charset='utf-8'><title>Detectors on the benchmark</title><style>{_STYLE}</style>"
    inline = Resources(mode="inline", components=["bokeh"]).render_js()
    body = "\n".join(["<h1>Detectors on the benchmark</h1>", *sections])
    return f"<!DOCTYPE html><html lang='en'><head>{head}{inline}</head><body>{body}{script}</body></html>"


def _main(outcome: Outcome) -> Mapping[str, Any]:
    return outcome.judged[outcome.plan.variants[0]]


def _section(table: Table) -> str:
    heads = "".join(f"<th>{escape(head)}</th>" for head in table.heads)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows[:_ON_PAGE]
    )
    left = len(table.rows) - _ON_PAGE
    more = f"<p class='note'>{left} more rows are in {escape(table.name)}.csv.</p>" if left > 0 else ""
    grid = f"<div class='wide'><table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>{more}"
    return f"<h2>{escape(table.title)}</h2><p class='note'>{escape(table.note)}</p>{grid}"


def _plot(name: str, curves: Mapping[str, Any]) -> Any:
    """Signals above, statistics below on a logarithmic scale; the onset and the level of alarms marked."""
    from bokeh.layouts import column
    from bokeh.models import Span
    from bokeh.plotting import figure

    tools = "pan,box_zoom,wheel_zoom,reset,save"
    top = figure(height=180, sizing_mode="stretch_width", tools=tools, y_axis_label="share of span")
    for colour, signal in zip(_COLOURS, ("CV", "X", "F"), strict=False):
        top.line(curves["t"], curves[signal], color=colour, legend_label=signal)
    below = figure(
        height=320, sizing_mode="stretch_width", tools=tools, x_range=top.x_range, y_axis_type="log",
        x_axis_label="time [s]", y_axis_label="statistic, alarm above 1",
    )  # fmt: skip
    for number, (detector, values) in enumerate(curves["statistics"].items()):
        line = below.line(curves["t"], values, color=_COLOURS[number % len(_COLOURS)], legend_label=detector)
        line.visible = number < 5
    below.add_layout(Span(location=1.0, dimension="width", line_dash="dashed", line_color="#1c2127"))
    for plot in (top, below):
        onset = scenario(name).faults[0].start_s
        plot.add_layout(Span(location=onset, dimension="height", line_color="#d0342c", line_dash="dotted"))
        plot.legend.click_policy, plot.legend.location, plot.toolbar.logo = "hide", "top_left", None
        plot.legend.label_text_font_size = "11px"
    return column(top, below, sizing_mode="stretch_width")
