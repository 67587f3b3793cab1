"""The drawings of a valve: what it does, the evidence against its limit, force over position, and its history."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bokeh.models import ColumnDataSource, DataRange1d, DatetimeTickFormatter
from bokeh.plotting import figure

MEASURED, WANTED, LIMIT, TRACE = "#0072B2", "#B35900", "#8C1D14", "#1c2127"
"""Told apart by the colour-blind, and by the way they are drawn."""

SHOWN_S = 300.0
"""How much the drawings follow [s]."""

LOOP_S = 60.0
"""How much the loop of force and position shows [s]."""


@dataclass(frozen=True)
class LivePlots:
    """Figures and what they draw. samples : t [POSIX ms], position, setpoint [mm], residual, threshold; loop : position
    [mm], force [N].
    """

    samples: ColumnDataSource
    loop: ColumnDataSource
    position: Any
    evidence: Any
    force: Any


def live_plots() -> LivePlots:
    """Empty drawings of a valve in service."""
    samples = ColumnDataSource(data={name: [] for name in ("t", "position", "setpoint", "residual", "threshold")})
    loop = ColumnDataSource(data={"position": [], "force": []})
    position = _over_time("position [mm]", 260, "position")
    position.line("t", "position", source=samples, color=MEASURED, line_width=2.5, legend_label="position")
    position.line(
        "t", "setpoint", source=samples, color=WANTED, line_width=1.5, line_dash="dashed", legend_label="set point"
    )
    evidence = _over_time("evidence / limit [1]", 220, "evidence", x_range=position.x_range)
    evidence.y_range = DataRange1d(start=0.0, min_interval=1.25, only_visible=True)
    evidence.line("t", "residual", source=samples, color=TRACE, line_width=2, legend_label="closest test")
    evidence.line(
        "t", "threshold", source=samples, color=LIMIT, line_width=2, line_dash="dotdash", legend_label="limit"
    )
    force = _dressed(_figure("position [mm]", "force [N]", 320, "force"))
    force.line("position", "force", source=loop, color=MEASURED, line_width=1.5)
    return LivePlots(samples, loop, _dressed(position), _dressed(evidence), force)


@dataclass(frozen=True)
class HistoryPlot:
    """One recording. samples : t [POSIX ms], position [mm]; wanted : t, setpoint [mm]."""

    samples: ColumnDataSource
    wanted: ColumnDataSource
    plot: Any


def history_plot() -> HistoryPlot:
    """An empty drawing of a recording."""
    samples = ColumnDataSource(data={"t": [], "position": []})
    wanted = ColumnDataSource(data={"t": [], "setpoint": []})
    plot = _figure("time [UTC]", "position [mm]", 240, "recorded", x_axis_type="datetime", visible=False)
    plot.line("t", "position", source=samples, color=MEASURED, line_width=2, legend_label="position")
    plot.line("t", "setpoint", source=wanted, color=WANTED, line_dash="dashed", legend_label="set point")
    return HistoryPlot(samples, wanted, _dressed(plot))


def _over_time(label: str, height: int, name: str, **options: Any) -> Any:
    if "x_range" not in options:
        options["x_range"] = DataRange1d(follow="end", follow_interval=1e3 * SHOWN_S, range_padding=0.0)
    return _figure("time [UTC]", label, height, name, x_axis_type="datetime", **options)


def _figure(x_label: str, y_label: str, height: int, name: str, **options: Any) -> Any:
    plot = figure(
        height=height, sizing_mode="stretch_width", min_width=260, name=name, x_axis_label=x_label,
        y_axis_label=y_label, tools="pan,box_zoom,reset", active_drag=None, active_scroll=None,
        toolbar_location="above", min_border_right=16,
        background_fill_color=None, border_fill_color=None, outline_line_color=None, **options,
    )  # fmt: skip
    plot.toolbar.logo = None
    plot.toolbar.stylesheets = ["@media print { :host { visibility: hidden; } }"]
    return plot


def _dressed(plot: Any) -> Any:
    for axis in plot.axis:
        axis.axis_label_text_font_style, axis.minor_tick_line_color = "normal", None
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "12px"
        if hasattr(axis.formatter, "hourmin"):
            axis.formatter = DatetimeTickFormatter(
                milliseconds="%H:%M:%S.%3N", seconds="%H:%M:%S", minsec="%H:%M:%S", minutes="%H:%M", hourmin="%H:%M",
                hours="%d %b %H:%M", days="%d %b", months="%b %Y",
            )  # fmt: skip
            axis.ticker.desired_num_ticks = 3
    if plot.legend:
        legend = plot.legend[0]
        legend.orientation, legend.location, legend.label_text_font_size = "horizontal", "left", "12px"
        legend.background_fill_alpha, legend.border_line_color, legend.padding, legend.margin = 0.0, None, 2, 2
        plot.add_layout(legend, "above")
    return plot
