"""How plots look: one figure factory, one set of colours that colour-blind readers tell apart."""

from __future__ import annotations

from typing import Any

MEASURED, RESIDUAL, REFERENCE, ALARM, NEUTRAL = "#3d97de", "#8a63c4", "#e0701a", "#d0342c", "#8a8f98"
INK = "#1c2127"
"""What the model says: as dark as the text on a light page; the page's script makes it light on a dark one."""
WIDE, NARROW = 4.5, 1.2
"""Measured wide and light below, simulated narrow and strong on top: told apart in black and white, too."""


def canvas(x_label: str, y_label: str, height: int, **options: Any) -> Any:
    """An empty bokeh figure as wide as the page: box zoom, pan, wheel zoom on demand, reset, save. Height in pixels."""
    from bokeh.plotting import figure

    plot = figure(
        height=height, sizing_mode="stretch_width", min_width=260, x_axis_label=x_label, y_axis_label=y_label,
        tools="pan,box_zoom,wheel_zoom,reset,save", active_drag="box_zoom", active_scroll=None,
        toolbar_location="above", min_border_right=16, background_fill_color=None, border_fill_color=None,
        outline_line_color=None, **options,
    )  # fmt: skip
    plot.toolbar.logo = None
    unprinted(plot.toolbar)
    for axis in plot.axis:
        dress(axis)
    return plot


def unprinted(toolbar: Any) -> None:
    """Tools do nothing on paper."""
    toolbar.stylesheets = ["@media print { :host { visibility: hidden; } }"]


def dress(axis: Any) -> None:
    """The lettering of an axis."""
    axis.axis_label_text_font_style = "normal"
    axis.axis_label_text_font_size = axis.major_label_text_font_size = "12px"
    axis.minor_tick_line_color = None


def inked(renderer: Any) -> Any:
    """A line or a cloud of what the model says, marked for the page's script, which keeps it in the ink of the text."""
    renderer.glyph.tags = ["ink"]
    return renderer


def finish_legend(plot: Any) -> None:
    """The legend above the plot, which the page's script wraps; a click on an entry hides its curve."""
    if not plot.legend:
        return
    legend = plot.legend[0]
    legend.orientation, legend.click_policy = "horizontal", "hide"
    legend.background_fill_alpha, legend.border_line_color = 0.0, None
    legend.label_text_font_size, legend.padding, legend.margin = "12px", 2, 2
    legend.ncols, legend.spacing, legend.label_standoff = 4, 10, 6
    plot.add_layout(legend, "above")
