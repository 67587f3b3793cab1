"""What the monitor and its page say to each other over a pipe: lines of JSON, one question and one answer at a time.

The page asks and the monitor answers. So a page that is slow asks less often, and never has anything wait for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cache
from typing import Any, Protocol

import numpy as np
from pydantic import BaseModel, ConfigDict, TypeAdapter
from pydantic_core import to_json

from hil.service.status import PlantStatus, RecentSamples
from recordings import Array

MOST_POINTS = 2000
"""Of a valve in one answer: more than a screen has columns."""

LONGEST_LINE = 16_000_000
"""Of a question or an answer [bytes]."""

COLUMNS = ("time_s", "position_m", "setpoint_m", "force_N", "residual", "threshold")


class WatchedPlant(Protocol):
    """What is shown: the service, and whatever else knows how a plant stands."""

    def status(self) -> PlantStatus:
        """All of it, as it is now."""

    def recent(self, tag: str) -> RecentSamples:
        """The newest samples of a valve. Raises KeyError for a tag that there is not."""


class PageQuestion(BaseModel):
    """What the page wants. after : by the tag of a valve that somebody looks at, the time of its newest known sample
    [POSIX s].
    """

    model_config = ConfigDict(extra="forbid")

    after: dict[str, float] = {}


@dataclass(frozen=True)
class RecentColumns:
    """FeedSamples that are new, by column; None for what is not read."""

    time_s: tuple[float, ...] = ()
    position_m: tuple[float, ...] | None = None
    setpoint_m: tuple[float, ...] | None = None
    force_N: tuple[float, ...] | None = None
    residual: tuple[float, ...] | None = None
    threshold: tuple[float, ...] | None = None

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class PageAnswer:
    """What the monitor says. recent : by tag, for each that was asked for and that there is."""

    status: PlantStatus
    recent: Mapping[str, RecentColumns] = field(default_factory=dict)


def answered(line: bytes, watched: WatchedPlant) -> bytes:
    """The line that answers a line. Raises pydantic's ValidationError for what is no question."""
    question = PageQuestion.model_validate_json(line)
    recent: dict[str, RecentColumns] = {}
    for tag, after in question.after.items():
        try:
            recent[tag] = _newer(watched.recent(tag), after)
        except KeyError:
            continue
    answer = {"status": watched.status(), "recent": recent}
    return to_json(answer, inf_nan_mode="constants", fallback=_plain) + b"\n"


def understood(line: bytes) -> PageAnswer:
    """An answer from its line. Raises pydantic's ValidationError for anything else."""
    return _answers().validate_json(line)


def asked(after: Mapping[str, float]) -> bytes:
    """The line of a question."""
    return PageQuestion(after=dict(after)).model_dump_json().encode() + b"\n"


@cache
def _answers() -> TypeAdapter[PageAnswer]:
    from identification.standard_tests import Interval  # who asks needs it, and who answers does not

    adapter = TypeAdapter(PageAnswer)
    adapter.rebuild(_types_namespace={"Interval": Interval})
    return adapter


def _newer(recent: RecentSamples, after: float) -> RecentColumns:
    first = int(np.searchsorted(recent.time_s, after, side="right"))
    chosen = slice(first, None, max(1, math.ceil((len(recent.time_s) - first) / MOST_POINTS)))

    def values(column: Array) -> tuple[float, ...]:
        return tuple(column[chosen].tolist())

    setpoint, force = recent.setpoint_m, recent.force_N
    return RecentColumns(
        values(recent.time_s), values(recent.position_m), None if setpoint is None else values(setpoint),
        None if force is None else values(force), values(recent.residual), values(recent.threshold),
    )  # fmt: skip


def _plain(value: Any) -> Any:
    """What JSON has no form for: read-only mappings, and numbers of numpy."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, datetime):
        return value.isoformat()
    raise TypeError(f"{type(value).__name__} cannot be told to the page")
