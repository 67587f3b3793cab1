"""The life of the link to one device, as a table: which states there are, what changes them, and what is announced.

    connecting   nothing has been heard since the start, the connection opened, or a back-off ended
    up           the last request was answered
    silent       one request was not answered, or not usably; the next may be
    down         the connection is lost, or cannot be opened
    backoff      two requests failed; a silent device rests, so that it does not cost its neighbours their time

What is announced is coarser: `link_up` with the first answer, `link_down` when the device cannot be reached any more.
One lost reply is neither.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Literal

Announcement = Literal["link_up", "link_down"]


class LinkPhase(Enum):
    """Where a link is in its life."""

    CONNECTING = "connecting"
    UP = "up"
    SILENT = "silent"
    DOWN = "down"
    BACKOFF = "backoff"


class Input(Enum):
    """What can happen to a link."""

    OPENED = "the connection opened"
    LOST = "the connection is lost or cannot be opened"
    ANSWERED = "the device answered"
    UNANSWERED = "the device did not answer, or not usably"
    DUE = "the back-off is over"


TRANSITIONS: Mapping[tuple[LinkPhase, Input], LinkPhase] = {
    (LinkPhase.CONNECTING, Input.ANSWERED): LinkPhase.UP,
    (LinkPhase.CONNECTING, Input.UNANSWERED): LinkPhase.BACKOFF,
    (LinkPhase.CONNECTING, Input.LOST): LinkPhase.DOWN,
    (LinkPhase.UP, Input.UNANSWERED): LinkPhase.SILENT,
    (LinkPhase.UP, Input.LOST): LinkPhase.DOWN,
    (LinkPhase.SILENT, Input.ANSWERED): LinkPhase.UP,
    (LinkPhase.SILENT, Input.UNANSWERED): LinkPhase.BACKOFF,
    (LinkPhase.SILENT, Input.LOST): LinkPhase.DOWN,
    (LinkPhase.BACKOFF, Input.DUE): LinkPhase.CONNECTING,
    (LinkPhase.BACKOFF, Input.LOST): LinkPhase.DOWN,
    (LinkPhase.DOWN, Input.OPENED): LinkPhase.CONNECTING,
}
"""What changes what; any other pair changes nothing."""

_ANNOUNCED: Mapping[LinkPhase, Announcement] = {
    LinkPhase.UP: "link_up",
    LinkPhase.SILENT: "link_up",
    LinkPhase.DOWN: "link_down",
    LinkPhase.BACKOFF: "link_down",
}


@dataclass(frozen=True)
class LinkState:
    """The state of one link: its phase, what was announced last, and how often in a row it did not answer.

    >>> state, said = LinkState().after(Input.ANSWERED)
    >>> state.phase.value, said, state.after(Input.UNANSWERED)[1], state.after(Input.LOST)[1]
    ('up', 'link_up', None, 'link_down')
    """

    phase: LinkPhase = LinkPhase.CONNECTING
    announced: Announcement | None = None
    unanswered: int = 0

    def after(self, happening: Input) -> tuple[LinkState, Announcement | None]:
        """The next state, and what to announce, if anything."""
        phase = TRANSITIONS.get((self.phase, happening), self.phase)
        unanswered = self.unanswered + 1 if happening is Input.UNANSWERED else self.unanswered
        if happening in (Input.ANSWERED, Input.OPENED):
            unanswered = 0
        announced = _ANNOUNCED.get(phase, self.announced)
        news = announced if announced != self.announced else None
        return LinkState(phase, announced, unanswered), news


@dataclass(frozen=True)
class BackOff:
    """How long to rest after failures in a row: doubling from `first` to `cap` [s].

    The cap is what bounds the time to come back after an outage, however long it was.

    >>> [BackOff(0.1, 1.0).delay(n) for n in (1, 2, 3, 4, 5, 10_000)]
    [0.1, 0.2, 0.4, 0.8, 1.0, 1.0]
    """

    first: float
    cap: float

    def delay(self, failures: int) -> float:
        """The rest after so many failures in a row, at least 1 [s]."""
        return min(self.first * 2.0 ** min(failures - 1, 60), self.cap)


REOPEN = BackOff(0.05, 0.5)
"""Between attempts to open a connection."""

REST = BackOff(0.1, 1.0)
"""Before a silent device is asked again."""
