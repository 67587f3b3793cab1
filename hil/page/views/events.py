"""The events of a valve as the page lists them: the newest first, and what repeats itself in one row."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from hil.monitor.event import MonitorEvent

MOST_ROWS = 20


@dataclass(frozen=True)
class EventRow:
    """Events of one kind that followed each other. wall : of the newest, POSIX [s]; times : how many there are;
    text : of the newest.
    """

    wall: float
    kind: str
    text: str
    times: int


def event_rows(events: Sequence[MonitorEvent]) -> list[EventRow]:
    """The rows for events in the order in which they came. Every judgement of the detector has one of its own."""
    return list(_rows(events))[:MOST_ROWS]


def _rows(events: Sequence[MonitorEvent]) -> Iterator[EventRow]:
    for (judged, kind), alike in groupby(events[::-1], key=lambda one: (one.judged, one.kind)):
        found = list(alike)
        if judged:
            yield from (EventRow(one.wall, kind, one.text, 1) for one in found)
        else:
            yield EventRow(found[0].wall, kind, found[0].text, len(found))
