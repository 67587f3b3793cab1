"""What a source yields: samples whose every value says how far it can be trusted, and what happened to the link."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from typing import Literal, NamedTuple

from hil.registers.codec import Decoded

EventKind = Literal["link_up", "link_down", "gap", "deadline_missed", "bad_value"]
"""The kinds of event that a source reports; the contract's others (alarm, cleared) are a detector's."""


def wall_at(moment: float) -> float:
    """The POSIX time [s] of a recent monotonic time [s]."""
    return time.time() - (time.monotonic() - moment)


def elapsed(moment: float, origin: float) -> float:
    """Seconds from one monotonic time to another, in whole nanoseconds.

    The last digits of a difference depend on how long the machine has been up. Without them, samples of a device that
    counts its own have the same times in every run.
    """
    return round(moment - origin, 9)


class Quality(StrEnum):
    """How far a value can be trusted, and if it cannot, why: in the words and the order of the recording's codes.

    NOT_VALID is what is no number, or what the map or the device calls invalid; LINK is no reply that can be used.
    """

    GOOD = "good"
    STALE = "stale"
    OUT_OF_RANGE = "out of range"
    NOT_VALID = "not valid"
    LINK = "link"


class Reading(NamedTuple):
    """One value of a sample. value : in `unit`, NaN when there is none; reason : in words, None when good; time : when
    the reply came that brought it, monotonic [s] as the sample's; NaN when none did.

    A stale reading keeps the value that was read, because it may help a human; nothing may compute with it.
    """

    value: float
    unit: str
    quality: Quality = Quality.GOOD
    reason: str | None = None
    time: float = math.nan

    @classmethod
    def of(cls, decoded: Decoded, unit: str, time: float) -> Reading:
        """The reading of what a reply says of a point."""
        if decoded.value is not None:
            return cls(decoded.value, unit, time=time)
        quality = Quality.OUT_OF_RANGE if decoded.out_of_range else Quality.NOT_VALID
        return cls(math.nan, unit, quality, decoded.reason or "no value", time)

    @property
    def good(self) -> bool:
        """Whether the value may be used."""
        return self.quality is Quality.GOOD

    @property
    def usable(self) -> float:
        """The value when it is good, else NaN."""
        return self.value if self.quality is Quality.GOOD else math.nan


@dataclass(frozen=True, slots=True)
class Sample:
    """What one valve said at one moment.

    time : monotonic [s], strictly increasing for one valve, of an arbitrary origin; wall : POSIX time [s];
    valve : its name; readings : by point name.

    >>> sample = Sample(12.5, 1.7e9, "LC74_20", {"position": Reading(0.0192, "m")})
    >>> sample.good, sample.at.year, sample["position"].usable
    (True, 2023, 0.0192)
    """

    time: float
    wall: float
    valve: str
    readings: Mapping[str, Reading]

    def __getitem__(self, name: str) -> Reading:
        return self.readings[name]

    @property
    def good(self) -> bool:
        """Whether every value may be used."""
        return all(reading.quality is Quality.GOOD for reading in self.readings.values())

    @property
    def at(self) -> datetime:
        """The wall-clock time, in UTC."""
        return datetime.fromtimestamp(self.wall, UTC)


@dataclass(frozen=True, slots=True)
class LinkEvent:
    """Something that happened to the way a valve's values take. time : monotonic [s]; wall : POSIX time [s]."""

    time: float
    wall: float
    valve: str
    kind: EventKind
    text: str
