"""What a valve's own movements in service say of it, as values that do not change."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the room behind it takes its time to load, and whoever only records does not need it
    from identification.standard_tests import Interval


@dataclass(frozen=True)
class Histogram:
    """Counts in classes. edges : (n + 1,) in `unit`, rising; counts : (n,); what is counted is said by the name."""

    edges: tuple[float, ...]
    counts: tuple[float, ...]
    unit: str


@dataclass(frozen=True)
class Trended:
    """A quantity, how sure it is, and where it goes.

    now : the latest value with its 95 % interval, in `unit`; per_day : its slope [unit a day] with the same, None until
    there are enough values; n : values it rests on; at : when the latest was taken, UTC.
    """

    now: Interval
    unit: str
    per_day: Interval | None
    n: int
    at: datetime


@dataclass(frozen=True)
class SignatureCurve:
    """Input against travel from natural movement. place : [% of the range that was seen]; up, down : in `unit`."""

    place: tuple[float, ...]
    up: tuple[float, ...]
    down: tuple[float, ...]
    unit: str


@dataclass(frozen=True)
class InServiceFigures:
    """The figures of one valve since it is watched; None for what its movements have not told yet.

    at : of the newest sample in them, UTC; observed_s : time with good values [s]; travel : time spent at positions [s]
    by position [%]; cycles : movements by their length [%], one to and one fro are two; travelled_strokes : whole
    travel in strokes; reversals : changes of direction; signature : see `SignatureCurve`; friction [N], or [Pa] where
    the diaphragm area is not known; spring_rate [N/m]; dead_band [% of span]; dead_time, t86 [s]; overshoot [% of the
    step]; steps : judged so far; notes : why something is missing.
    """

    at: datetime
    observed_s: float
    travel: Histogram
    cycles: Histogram
    travelled_strokes: float
    reversals: int
    signature: SignatureCurve | None = None
    friction: Trended | None = None
    spring_rate: Trended | None = None
    dead_band: Trended | None = None
    dead_time: Trended | None = None
    t86: Trended | None = None
    overshoot: Trended | None = None
    steps: int = 0
    notes: tuple[str, ...] = ()
