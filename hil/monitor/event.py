"""An event of the monitor: what happened to a valve, or to the way its values take, as one line of JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

MonitorKind = Literal["alarm", "cleared", "link_down", "link_up", "gap", "deadline_missed", "bad_value"]

NAMED = ("friction", "spring")
"""Faults that the event stream has a word for; the others stand in the text alone."""


@dataclass(frozen=True, slots=True)
class MonitorEvent:
    """One event. t_s : time since the first sample [s]; wall : POSIX time [s]; fault : a kind of `detector.KINDS`, or
    None when it is unknown or there is none; residual, threshold : of the test that was closest to its limit.

    >>> MonitorEvent(70.005, 0.0, "LC74_20", "alarm", "friction changed", "friction", 2.5, 1.0).json_line()[:80]
    '{"time": "1970-01-01T00:00:00.000000Z", "t_s": 70.005, "valve": "LC74_20", "kind'
    """

    t_s: float
    wall: float
    valve: str
    kind: MonitorKind
    text: str
    fault: str | None = None
    residual: float | None = None
    threshold: float | None = None

    @property
    def judged(self) -> bool:
        """Whether it is a judgement of the detector; all others come from the source, and are recorded by its name."""
        return self.kind in ("alarm", "cleared")

    def json_line(self) -> str:
        """One line of the event stream."""
        about = {
            "time": datetime.fromtimestamp(self.wall, UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ"),
            "t_s": round(self.t_s, 6), "valve": self.valve, "kind": self.kind,
            "fault": self.fault if self.fault in NAMED else None,
            "residual": self.residual, "threshold": self.threshold, "text": self.text,
        }  # fmt: skip
        return json.dumps(about)
