"""What a detector saw, as a picture and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from detector.watch.judgement import Judgement
from recordings import Array


class DrawnWatch(Protocol):
    """What is drawn of a watched recording: see `Watched`."""

    @property
    def time_s(self) -> Array: ...
    @property
    def load(self) -> Array: ...
    @property
    def alarm(self) -> NDArray[np.bool_]: ...
    @property
    def changes(self) -> tuple[Judgement, ...]: ...


LOAD, LIMIT, ALARM = "#3d97de", "#8a8f98", "#d0342c"


def picture(seen: DrawnWatch) -> Any:
    """The largest score over time with its limit and the alarms, as a bokeh figure."""
    from bokeh.plotting import figure

    plot = figure(
        height=320, sizing_mode="stretch_width", x_axis_label="time [s]", y_axis_label="largest score, limit 1",
        tools="pan,box_zoom,wheel_zoom,reset,save", active_drag="box_zoom",
    )  # fmt: skip
    plot.line(seen.time_s, seen.load, color=LOAD, legend_label="score")
    plot.line(seen.time_s[[0, -1]] if len(seen.time_s) else [], np.ones(2 * bool(len(seen.time_s))), color=LIMIT,
              legend_label="limit")  # fmt: skip
    over = seen.alarm
    plot.scatter(seen.time_s[over], seen.load[over], color=ALARM, size=3, legend_label="alarm")
    plot.legend.click_policy, plot.legend.orientation, plot.toolbar.logo = "hide", "horizontal", None
    plot.add_layout(plot.legend[0], "above")  # never over the data
    return plot


def table(seen: DrawnWatch, caption: str = "") -> str:
    """When an alarm began, ended or changed its kind, as an HTML table."""
    heads = "".join(f"<th>{word}</th>" for word in ("time [s]", "what", "kind", "test", "score, limit 1"))
    rows = "".join(f"<tr>{''.join(f'<td>{escape(word)}</td>' for word in _row(one))}</tr>" for one in seen.changes)
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f"<table>{above}<thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"


def _row(one: Judgement) -> Sequence[str]:
    what = "alarm" if one.began else "cleared" if one.ended else "named anew"
    return f"{one.time_s:.2f}", what, one.kind or "unknown", one.test, f"{one.load:.2f}"
