"""The main pictures of a result for a notebook, or for a page of one's own."""

from __future__ import annotations

from typing import Any

from identification.report.sections.friction import friction
from identification.report.sections.loop import loop
from identification.report.sections.signals import overlay as signal_overlay
from identification.report.trace.before_after import before_after, errors, overlay
from identification.result import FitResult
from identification.tracing.result import TraceResult


def figures(result: FitResult | TraceResult) -> dict[str, Any]:
    """Bokeh figures of a fit or of a trace by title, the most telling first.

    Of a fit: measured and simulated over time, the valve signature, the friction map (where the model has LuGre
    friction). Of a trace: a held-out recording with the model before and after, their errors.
    `stacked` makes one layout of them.
    """
    return _of_trace(result) if isinstance(result, TraceResult) else _of_fit(result)


def stacked(result: FitResult | TraceResult) -> Any:
    """The figures one below the other, as a bokeh layout: show it with ``bokeh.io.show``."""
    from bokeh.layouts import column

    return column(*figures(result).values(), sizing_mode="stretch_width")


def _of_fit(identification: FitResult) -> dict[str, Any]:
    maps = friction(identification).plots
    shown = {
        "Measured and simulated": signal_overlay(identification),
        "Valve signature: force against position": loop(identification).plots["loop"],
    }
    return shown | ({"Friction against velocity": maps["all"]} if maps else {})


def _of_trace(trace: TraceResult) -> dict[str, Any]:
    shown = before_after(trace)
    signal, error = overlay(shown), errors(shown)
    error.x_range = signal.x_range
    return {f"{shown.name} ({shown.role}): measured and models": signal, "Errors of the models": error}
