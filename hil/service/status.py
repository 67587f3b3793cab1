"""How a plant stands at one moment: what the page, the metrics and the sinks read, and nobody can change.

The words for a valve's state are those of NAMUR NE 107 (2017), "Self-monitoring and diagnosis of field devices".
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from types import MappingProxyType

from hil.monitor.event import MonitorEvent
from hil.service.in_service.figures import InServiceFigures
from recordings import Array


class Health(StrEnum):
    """The state of a device in the words of NAMUR NE 107, in rising order; each has a letter, a shape and a colour.

    >>> Health.worst([Health.GOOD, Health.MAINTENANCE]).letter
    'M'
    """

    GOOD = "good"
    MAINTENANCE = "maintenance required"
    OUT_OF_SPEC = "out of specification"
    CHECK = "check function"
    FAILURE = "failure"

    @property
    def rank(self) -> int:
        """0 for good, rising with severity."""
        return tuple(Health).index(self)

    @property
    def letter(self) -> str:
        """The standard's letter; empty for good."""
        return {"maintenance required": "M", "out of specification": "S", "check function": "C", "failure": "F"}.get(
            self.value, ""
        )

    @property
    def shape(self) -> str:
        """A shape that tells it without colour, by the name of a bokeh marker."""
        return ("circle", "diamond", "triangle", "inverted_triangle", "circle_x")[self.rank]

    @property
    def colour(self) -> str:
        """The standard's colours (green, blue, yellow, orange, red), in tones that the colour-blind can tell apart."""
        return ("#009E73", "#0072B2", "#F0E442", "#E69F00", "#D55E00")[self.rank]

    @classmethod
    def worst(cls, found: Iterable[Health]) -> Health:
        """The worst of several; good when there is none."""
        return max(found, key=lambda one: one.rank, default=cls.GOOD)


@dataclass(frozen=True)
class LinkStatus:
    """The way a valve's values take. source : its address; connected : whether the device answers; age_s : since the
    last sample with a good position [s], infinite before the first; samples : taken; lost : that a full queue dropped
    before they were looked at; late : deadlines missed on this source; reconnects : link_up after a link_down; words :
    a sentence on all of it.
    """

    source: str
    connected: bool
    age_s: float
    samples: int
    lost: int
    late: int
    reconnects: int
    words: str


@dataclass(frozen=True)
class ValveStatus:
    """One valve. health, reason : what is wrong in one sentence; since : UTC; evidence : what shows it; check : what to
    look at on site; figures : None before the first update; latest : the last good values by signal, in SI units or
    shares; events : the newest, latest last.
    """

    tag: str
    health: Health
    reason: str
    since: datetime
    evidence: tuple[str, ...]
    check: tuple[str, ...]
    link: LinkStatus
    figures: InServiceFigures | None = None
    latest: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    events: tuple[MonitorEvent, ...] = ()
    phase: str = "learning"
    load: float = 0.0


@dataclass(frozen=True)
class TaskStatus:
    """A supervised task. restarts : after failures; last_error : in words, empty when there was none; dropped : items
    that it was too slow for.
    """

    name: str
    running: bool
    restarts: int
    last_error: str
    dropped: int


@dataclass(frozen=True)
class PlantStatus:
    """All valves and tasks at one moment. at : UTC."""

    plant: str
    at: datetime
    valves: tuple[ValveStatus, ...]
    tasks: tuple[TaskStatus, ...]

    @property
    def health(self) -> Health:
        """The worst of all valves."""
        return Health.worst(valve.health for valve in self.valves)


@dataclass(frozen=True)
class RecentSamples:
    """The newest samples of one valve, newest last, (n,) each. time_s : POSIX [s]; position_m : [m]; setpoint_m : [m],
    None where it is not read; force_N : [N], None where it is not read; residual, threshold : score and limit of the
    test that is closest to its limit, NaN while nothing is judged. A value that was not good is NaN.
    """

    time_s: Array
    position_m: Array
    setpoint_m: Array | None
    force_N: Array | None
    residual: Array
    threshold: Array
