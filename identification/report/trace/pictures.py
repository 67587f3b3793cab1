"""Pictures of the force that the model did not account for: those in which the effect shows, the others folded away."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.report.canvas import BEFORE, INK, canvas, finish_legend, inked
from identification.report.section import Section
from identification.report.trace.dependence import SHOWS, Dependence, dependences, edges, seen_models, spectrum
from identification.report.wording.numbers import number, percent
from identification.tracing.models.model import Model
from identification.tracing.result import TraceResult
from recordings import Array

MOST = 3
"""Pictures that are open at first."""
FEWEST = 12
"""Samples of a bin that is drawn, at least."""
STRIPES = 24
"""Bins of a band."""
ENDS = (0.005, 0.995)
"""Quantiles between which they lie."""
LINES = 400
"""Frequencies drawn, at most."""
RESTS = 4
"""Groups of times at rest."""
IN_GROUPS = ("direction", "time at rest")
"""Quantities with few values or with most samples at one value: they are drawn as boxes."""
Side = tuple[str, str, dict[str, Dependence]]
"""Name, colour and dependences by name, of the model before or after."""


@dataclass(frozen=True)
class Picture:
    """A picture : title, share of the variance that it explains, names of its plots, whether it has boxes."""

    title: str
    share: str
    plots: tuple[str, ...]
    boxes: bool


def pictures(trace: TraceResult) -> Section:
    """The section of the residual force."""
    models = seen_models(trace)
    names = ("before", "after") if len(models) > 1 else ("model",)
    found = [dependences(model) for model in models]
    sides = [
        (name, colour, {one.name: one for one in some})
        for name, colour, some in zip(names, (BEFORE, INK) if len(models) > 1 else (INK,), found, strict=True)
    ]
    drawn = [(one.share, *_picture(one, sides)) for one in found[0]]
    drawn.append(_frequencies(models, names))
    drawn.sort(key=lambda one: -one[0])
    shown = [one for one in drawn if one[0] >= SHOWS][:MOST] if trace.verdict != "none" else []
    words = {
        "open": [picture for _, picture, _ in shown],
        "folded": [picture for one in drawn if one not in shown for picture in one[1:2]],
        "least": percent(SHOWS), "best": percent(drawn[0][0]), "best_name": drawn[0][1].title,
        "verdict": trace.verdict, "two": len(models) > 1, "held_out": trace.selection.only_held_out,
    }  # fmt: skip
    plots = {name: plot for _, _, some in drawn for name, plot in some.items()}
    return Section("pictures", "Where it shows" if shown else "Force that is not accounted for", words, plots)


def _picture(first: Dependence, sides: list[Side]) -> tuple[Picture, dict[str, Any]]:
    """The plots of one quantity, in either direction where that matters."""
    name = first.name.replace(" ", "_")
    if first.name in IN_GROUPS:
        return Picture(first.name, percent(first.share), (name,), True), {name: _boxes(first, sides)}
    halves = (("rising", True), ("falling", False)) if first.both else (("", None),)
    plots, y_range = {}, None
    for words, rising in halves:
        plot = _band(first, sides, rising, f"{first.name}, {words}" if words else first.name, y_range)
        y_range = plot.y_range
        plots[f"{name}_{words}".rstrip("_")] = plot
    return Picture(first.name, percent(first.share), tuple(plots), False), plots


def _band(first: Dependence, sides: list[Side], rising: bool | None, title: str, y_range: Any) -> Any:
    """Median and the middle 80 % of the force over a quantity."""
    options = {} if y_range is None else {"y_range": y_range}
    plot = canvas(f"{title} [{first.unit}]", "force not accounted for [N]", 280, **options)
    for name, colour, known in sides:
        one = known[first.name]
        some = np.ones(len(one.force), bool) if rising is None else one.rising == rising
        middle, low, median, high = _quantiles(one.values[some], one.force[some])
        area = plot.varea(middle, low, high, fill_color=colour, fill_alpha=0.25, legend_label=name)
        line = plot.line(middle, median, color=colour, line_width=2, legend_label=name)
        if colour == INK:
            inked(area), inked(line)
    finish_legend(plot)
    return plot


def _quantiles(values: Array, force: Array) -> tuple[Array, Array, Array, Array]:
    """Middles of bins and 10, 50 and 90 % quantiles of the force in them; one outlier moves none of them."""
    first, last = (float(np.quantile(values, end)) if len(values) else end for end in ENDS)
    place = np.digitize(values, np.linspace(first, last, STRIPES + 1))
    groups = [place == i for i in range(1, STRIPES + 1)]
    rows = [
        (np.median(values[at]), *np.quantile(force[at], (0.1, 0.5, 0.9))) for at in groups if at.sum() >= FEWEST
    ] or [(0.0, 0.0, 0.0, 0.0)]
    middle, low, median, high = np.array(rows, np.float32).T
    return middle, low, median, high


def _boxes(first: Dependence, sides: list[Side]) -> Any:
    """Boxes of the force, one per group and model: middle half, middle 90 %, median."""
    from bokeh.models import FixedTicker

    labels, places = _groups(first, sides)
    unit = f" [{first.unit}]" if first.unit else ""
    plot = canvas(f"{first.name}{unit}", "force not accounted for [N]", 280, x_range=(-0.6, len(labels) - 0.4))
    plot.xaxis.ticker = FixedTicker(ticks=list(range(len(labels))))
    plot.xaxis.major_label_overrides = dict(enumerate(labels))
    plot.xgrid.grid_line_color = None
    for i, ((name, colour, known), place) in enumerate(zip(sides, places, strict=True)):
        force = known[first.name].force
        rows = [
            (group, *np.quantile(force[place == group], (0.05, 0.25, 0.5, 0.75, 0.95)))
            for group in range(len(labels)) if (place == group).sum() >= FEWEST
        ] or [(0.0,) * 6]  # fmt: skip
        group, least, low, median, high, most = np.array(rows, np.float32).T
        x, width = group + (i - (len(sides) - 1) / 2) * 0.3, 0.24
        parts = [
            plot.segment(x, least, x, most, color=colour, line_width=1.5, legend_label=name),
            plot.vbar(x, width, high, low, color=colour, fill_alpha=0.35, legend_label=name),
            plot.segment(x - width / 2, median, x + width / 2, median, color=colour, line_width=3),
        ]
        for part in parts if colour == INK else ():
            inked(part)
    finish_legend(plot)
    return plot


def _groups(first: Dependence, sides: list[Side]) -> tuple[list[str], list[Array]]:
    """Labels of the groups, and the group of every sample of every model."""
    every = [known[first.name] for _, _, known in sides]
    if first.name == "direction":
        return ["falling", "rising"], [one.rising.astype(int) for one in every]
    rested = first.values[first.values > 0]
    inner = edges(rested, RESTS) if len(rested) > RESTS * FEWEST else np.zeros(0)
    cuts = np.concatenate([[0.0], inner, [max(float(one.values.max()) for one in every)]])
    labels = ["none", *(f"{number(a, 2)} – {number(b, 2)}" for a, b in itertools.pairwise(cuts))]
    return labels, [np.where(one.values > 0, 1 + np.digitize(one.values, inner, right=True), 0) for one in every]


def _frequencies(models: list[Model], names: tuple[str, ...]) -> tuple[float, Picture, dict[str, Any]]:
    """Amplitudes over frequency."""
    plot = canvas("frequency [Hz]", "amplitude [N]", 280, x_axis_type="log")
    shares = []
    for model, name, colour in zip(models, names, (BEFORE, INK) if len(models) > 1 else (INK,), strict=True):
        f, amplitude, share = spectrum(model)
        shares.append(share)
        place = np.digitize(f, np.geomspace(f[0], f[-1], LINES + 1))
        drawn = [(f[place == i].mean(), amplitude[place == i].max()) for i in np.unique(place)]
        line = plot.line(*np.array(drawn, np.float32).T, color=colour, line_width=1.2, legend_label=name)
        if colour == INK:
            inked(line)
    finish_legend(plot)
    return shares[0], Picture("frequency", percent(shares[0]), ("frequency",), False), {"frequency": plot}
