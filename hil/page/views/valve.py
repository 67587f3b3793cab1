"""One valve: what it does now, what speaks against it, what happened to it, and what was recorded."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from bokeh.document import Document, without_document_lock
from bokeh.models import ColumnDataSource

from hil.page.feed import Feed, FeedSamples
from hil.page.views.events import event_rows
from hil.page.views.figures import figure_rows, histograms, signature
from hil.page.views.history import RecordedHistories, RecordedHistory, about, history_of
from hil.page.views.live import CARRIER, LivePage
from hil.page.views.plant import Badge, notices, silence_words
from hil.page.views.plots import LOOP_S, SHOWN_S, LivePlots, history_plot, live_plots
from hil.page.views.rendering import template
from hil.page.views.words import SHOWN, clock, measured, since
from hil.service.in_service.figures import InServiceFigures
from recordings import Array, BadInput

MOST_DRAWN = 4000
"""Samples in a drawing that follows."""


class ValvePage:
    """The page of one valve for one browser. recordings : folder, None where nothing is recorded."""

    def __init__(self, feed: Feed, recordings: Path | None, tag: str, doc: Document) -> None:
        self._feed, self._tag, self._doc = feed, tag, doc
        self._recordings = RecordedHistories(recordings, tag)
        self._plots, self._history = live_plots(), history_plot()
        self._drawn = 0
        self._chosen, self._said = "", ""
        self._choice = ColumnDataSource(data={"file": [""]}, name="choice", tags=CARRIER)
        self._choice.on_change("data", self._choose)
        live = LivePage(feed, doc, "valve.html", tag, "/", self._pieces)
        for root in (self._choice, self._plots.position, self._plots.evidence, self._plots.force, self._history.plot):
            doc.add_root(root)
        if feed.valve(tag) is not None:
            live.also(self._draw)
            feed.look(tag)
            doc.on_session_destroyed(self._closed)

    def _pieces(self) -> Mapping[str, str]:
        valve = self._feed.valve(self._tag)
        status = self._feed.status
        if valve is None or status is None:
            places = ("head", "notices", "values", "check", "figures", "events", "link", "history")
            return dict.fromkeys(places, "") | {"head": template("no_valve.html").render(tag=self._tag)}
        silence = silence_words(self._feed.silence_of(valve))
        said = [silence] if silence else []
        return {
            "head": template("valve_head.html").render(
                tag=valve.tag, badge=Badge.of(valve.health), reason=valve.reason, since=since(valve.since, status.at)
            ),
            "notices": template("notices.html").render(notices=notices(self._feed, status) + said),
            "values": template("values.html").render(
                values=[measured(name, valve.latest[name]) for name in SHOWN if name in valve.latest],
                load=valve.load, phase=valve.phase, old=bool(silence),
            ),
            "check": template("check.html").render(evidence=valve.evidence, check=valve.check),
            "figures": _figures(valve.figures),
            "events": template("events.html").render(events=event_rows(valve.events), clock=clock),
            "link": template("link.html").render(link=valve.link),
            "history": template("history.html").render(
                files=self._recordings.files, chosen=self._chosen, said=self._said
            ),
        }  # fmt: skip

    def _closed(self, _: object) -> None:
        self._feed.look_away(self._tag)

    def _draw(self) -> None:
        samples = self._feed.samples(self._tag)
        n_new = min(samples.added - self._drawn, len(samples))
        self._drawn = samples.added
        if n_new > 0:
            stream(self._plots, samples, n_new)

    def _choose(self, attr: str, old: object, new: Mapping[str, Sequence[object]]) -> None:
        """A recording was chosen in the browser; only the names that were offered are files."""
        chosen = str((*new.get("file", ()), "")[0])
        path = self._recordings.path(chosen)
        if path is None:
            return
        self._chosen, self._said = chosen, "Reading …"

        async def read() -> None:
            try:
                found = await asyncio.to_thread(history_of, path)
            except (BadInput, OSError) as problem:
                self._said = str(problem)
            else:
                self._doc.add_next_tick_callback(partial(self._show, found))

        self._doc.add_next_tick_callback(without_document_lock(read))  # the page goes on meanwhile

    def _show(self, found: RecordedHistory) -> None:
        self._said = about(found)
        self._history.samples.data = dict(found.samples)
        self._history.wanted.data = dict(found.wanted)
        self._history.plot.visible = True


def valve_document(feed: Feed, recordings: Path | None, doc: Document) -> None:
    """Fill a document with the page of the valve that the address names."""
    arguments = doc.session_context.request.arguments if doc.session_context else {}
    tag = arguments.get("tag", [b""])[0].decode(errors="replace")
    ValvePage(feed, recordings, tag, doc)


def _figures(figures: InServiceFigures | None) -> str:
    return template("figures.html").render(
        rows=figure_rows(figures), notes=() if figures is None else figures.notes,
        histograms=[] if figures is None else histograms(figures),
        signature=None if figures is None else signature(figures.signature),
    )  # fmt: skip


def stream(plots: LivePlots, samples: FeedSamples, n_new: int) -> None:
    """Draw the newest samples; a line is broken where nothing came for a while."""
    time, *rest = (_tail(samples.columns[name], n_new) for name in ("time_s", "position_m", "setpoint_m", "residual"))
    position, setpoint, residual = rest
    force, threshold = _tail(samples.columns["force_N"], n_new), _tail(samples.columns["threshold"], n_new)
    columns = {
        "t": 1e3 * time, "position": 1e3 * position, "setpoint": 1e3 * setpoint, "residual": residual,
        "threshold": threshold,
    }  # fmt: skip
    before = plots.samples.data["t"]
    if len(before) and time[0] - float(before[-1]) / 1e3 > _longest_step(samples):
        broken = {name: np.insert(column, 0, math.nan) for name, column in columns.items()}
        broken["t"][0] = 1e3 * time[0] - 1.0
        columns = broken
    step = _usual_step(samples)
    drawn = int(min(MOST_DRAWN, max(200, SHOWN_S / step))) if step > 0.0 else MOST_DRAWN
    plots.samples.stream(columns, rollover=drawn)
    looped = int(min(MOST_DRAWN, max(50, LOOP_S / step))) if step > 0.0 else MOST_DRAWN
    plots.loop.stream({"position": 1e3 * position, "force": force}, rollover=looped)


def _tail(column: list[float] | None, n: int) -> Array:
    return np.full(n, math.nan) if column is None else np.array(column[-n:], dtype=float)


def _usual_step(samples: FeedSamples) -> float:
    """Median time between the last samples [s]; 0 where that is not known."""
    steps = np.diff(samples.times[-200:])
    return float(np.median(steps)) if len(steps) else 0.0


def _longest_step(samples: FeedSamples) -> float:
    """Time without a sample beyond which a line is broken [s]."""
    return max(1.0, 5.0 * _usual_step(samples))
