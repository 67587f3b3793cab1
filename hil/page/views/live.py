"""How what changes comes to a page that is open: pieces of HTML by their places, and a beat that says it is alive."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from bokeh.document import Document
from bokeh.models import ColumnDataSource

from hil.page.feed import Feed
from hil.page.views.rendering import template

BEAT_MS = 400
"""How often a page is renewed [ms]; without a beat for a while it says that no data come."""

Pieces = Callable[[], Mapping[str, str]]


CARRIER = ["carrier"]
"""Marks what is in a document to be sent, and not to be seen."""


class LivePage:
    """A document whose pieces follow the plant.

    feed : is asked as often as needed while the document is open; name : of the template; title : of the window; back :
    address of the page above, None where there is none; pieces : called at every beat, gives HTML by the id of its
    place, always for the same places.
    """

    def __init__(self, feed: Feed, doc: Document, name: str, title: str, back: str | None, pieces: Pieces) -> None:
        self._pieces, self._beats = pieces, 0
        feed.open()
        doc.on_session_destroyed(lambda _: feed.close())
        first = dict(pieces())
        self._places = {
            place: ColumnDataSource(data={"html": [html]}, name=place, tags=CARRIER) for place, html in first.items()
        }
        self._beat = ColumnDataSource(data={"beat": [0], "places": [list(first)]}, name="beat", tags=CARRIER)
        self._calls: list[Callable[[], None]] = []
        doc.title, doc.template = title, template(name)
        doc.template_variables.update({"pieces": first, "back": back})
        doc.config.notify_connection_status = False  # the page says so itself
        doc.config.reconnect_session = False
        for source in (*self._places.values(), self._beat):
            doc.add_root(source)
        doc.add_periodic_callback(self._renew, BEAT_MS)

    def also(self, call: Callable[[], None]) -> None:
        """Have something else renewed at every beat."""
        self._calls.append(call)

    def _renew(self) -> None:
        for place, html in self._pieces().items():
            source = self._places[place]
            if source.data["html"] != [html]:
                source.data = {"html": [html]}
        for call in self._calls:
            call()
        self._beats += 1
        self._beat.data = {"beat": [self._beats], "places": self._beat.data["places"]}
