"""How plots look: one figure factory, one set of colours that colour-blind readers tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from recordings import Array

MEASURED, RESIDUAL, REFERENCE, ALARM, NEUTRAL = "#3d97de", "#8a63c4", "#e0701a", "#d0342c", "#8a8f98"
BEFORE = REFERENCE
"""The model before something was added to it."""
INK = "#1c2127"
"""What the model says: as dark as the text on a light page; the page's script makes it light on a dark one."""
WIDE, NARROW = 4.5, 1.2
"""Measured wide and light below, simulated narrow and strong on top: told apart in black and white, too."""

BAND = 2.576
"""Half width of the band that holds 99 % of normal noise, in standard deviations."""
OVERSHOOT = 1.0
"""How far the axes go beyond the measured signal for the sake of a simulated one, in ranges of the measured."""


def canvas(x_label: str, y_label: str, height: int, **options: Any) -> Any:
    """An empty bokeh figure as wide as the page: box zoom, pan, wheel zoom on demand, reset, save. Height in pixels.

    Its lettering may be of a file's: it is plain text, in which no mathematics is read.
    """
    from bokeh.models import PlainText
    from bokeh.plotting import figure

    title = options.pop("title", "")
    plot = figure(
        height=height, sizing_mode="stretch_width", min_width=260, x_axis_label=PlainText(x_label),
        y_axis_label=PlainText(y_label),
        tools="pan,box_zoom,wheel_zoom,reset,save", active_drag="box_zoom", active_scroll=None,
        toolbar_location="above", min_border_right=16, background_fill_color=None, border_fill_color=None,
        outline_line_color=None, **options,
    )  # fmt: skip
    if title:
        plot.title.text = PlainText(title)
    plot.toolbar.logo = None
    unprinted(plot.toolbar)
    for axis in plot.axis:
        dress(axis)
    return plot


def robust_range(main: Array, others: Sequence[Array], overshoot: float = OVERSHOOT) -> tuple[float, float]:
    """Limits of an axis that show all of one signal and nearly all (99 %) of the others, but of those no more than
    `overshoot` ranges of the first beyond it: a run that diverges must not flatten the picture. 0 to 1 where nothing
    is known.
    """
    known = main[np.isfinite(main)]
    if not len(known):
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    reach = overshoot * ((high - low) or max(abs(high), 1e-9))
    ends = [np.quantile(v[np.isfinite(v)], (0.005, 0.995)) for v in others if np.isfinite(v).any()]
    bottom = max(low - reach, min([low, *(float(e[0]) for e in ends)]))
    top = min(high + reach, max([high, *(float(e[1]) for e in ends)]))
    margin = 0.05 * (top - bottom)
    return bottom - margin, top + margin


def shade(plot: Any, half: float) -> None:
    """A grey band from minus to plus `half`, in the unit of the axis: where noise lies."""
    from bokeh.models import BoxAnnotation

    plot.add_layout(BoxAnnotation(bottom=-half, top=half, fill_color=NEUTRAL, fill_alpha=0.25, line_color=None))


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
