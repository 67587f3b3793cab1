"""Which ups and downs of a link are told: of one that comes and goes, the beginning, and the end with the count."""

from __future__ import annotations

import math

from hil.source.episode import QUIET_S, Episode
from hil.source.sample import LinkEvent


class LinkNews:
    """The link of one valve. A loss is told at once, and so is that it is back. One that is lost again within `QUIET_S`
    is told to be lost until it has held for so long; so nobody believes that it is there while it comes and goes.

    >>> news = LinkNews()
    >>> [news.told(LinkEvent(t, 0.0, "V", kind, "")) for t, kind in ((1.0, "link_down"), (2.0, "link_up"),
    ...     (5.0, "link_down"), (6.0, "link_up"), (9.0, "link_down"), (9.5, "link_up"))]
    [True, True, True, False, False, False]
    >>> news.holds(30.0), news.holds(40.0)
    (None, 'it holds again, after 3 losses in 8.0 s')
    """

    def __init__(self) -> None:
        self._losses: Episode | None = None
        self._up_at, self._up, self._held = -math.inf, True, False

    def told(self, event: LinkEvent) -> bool:
        """Whether an event of the source is told."""
        if event.kind == "link_down":
            self._up = False
            if self._losses is not None and event.time - self._up_at < QUIET_S:
                self._losses.again(event.time)
            else:
                self._losses = Episode.begin(event.time)
            return not self._held
        if event.kind == "link_up":
            self._up, self._up_at = True, event.time
            self._held = self._losses is not None and self._losses.more
            return not self._held
        return True

    def holds(self, now: float) -> str | None:
        """At a sample [s]: what to tell of a link that has held for long enough, None for nothing."""
        losses = self._losses
        if losses is None or not (self._up and self._held) or now - self._up_at < QUIET_S:
            return None
        self._held = False
        return f"it holds again, after {losses.n} losses in {losses.lasted_s:.1f} s"
