"""The header of a recording: all that its file declares, without samples and events."""

from __future__ import annotations

import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from types import MappingProxyType
from typing import Any, Literal, get_args

from recordings.errors import BadInput
from recordings.plant import Plant, is_number
from recordings.signal import SignalSpec, text_problem

Origin = Literal["plant", "rig", "simulated"]
ORIGINS: tuple[Origin, ...] = get_args(Origin)

RESERVED = frozenset({"format", "version", "title", "source", "created", "journal"})
"""Root attributes with a meaning of their own; further attributes carry other names."""


@dataclass(frozen=True)
class Header:
    """All of a recording but its samples and events: what its file declares. The fields are those of `Recording`.

    per_value : whether the quality and the reply time of each value are kept, which makes the file version 2.
    """

    signals: tuple[SignalSpec, ...]
    plant: Plant = field(default_factory=Plant)
    title: str | None = None
    source: Origin | None = None
    created: datetime | None = None
    attributes: Mapping[str, str | float] = field(default_factory=dict)
    per_value: bool = False

    def __post_init__(self) -> None:
        problem = signals_problem(self.signals) or _about_problem(self)
        if problem:
            raise BadInput(*problem)
        object.__setattr__(self, "attributes", MappingProxyType(dict(self.attributes)))


def signals_problem(specs: Sequence[SignalSpec]) -> tuple[str, str, str] | None:
    """What is wrong with a set of signals, as (where, found, remedy); exactly one is the clock, named time."""
    names = [spec.name for spec in specs]
    clocks = [spec.name for spec in specs if spec.role == "time"]
    rule = "exactly one signal has the role 'time', and its name is 'time'"
    if len(set(names)) != len(names):
        return "/signals", "two signals share a name", f"the names are {', '.join(sorted(names))}; rename one"
    if not clocks:
        return "/signals", "no signal has the role 'time'", rule
    if len(clocks) > 1:
        return "/signals", f"{len(clocks)} signals have the role 'time': {', '.join(clocks)}", rule
    if clocks != ["time"]:
        return f"/signals/{clocks[0]}", "the signal with the role 'time' has another name", rule
    return None


def created_problem(created: Any) -> tuple[str, str] | None:
    """What is wrong with a date of creation, as (found, remedy); None when it has a time zone."""
    if not isinstance(created, datetime) or created.tzinfo is None:
        remedy = "write ISO 8601 with time zone, such as 2026-11-21T09:30:00+01:00"
        return f"'{created}' is not a date with a time zone", remedy
    return None


def attribute_problem(name: Any, value: Any) -> tuple[str, str] | None:
    """What is wrong with a further attribute, as (found, remedy); None when it can be kept."""
    if text_problem(name) or not name or name in RESERVED:
        remedy = f"not empty and none of {', '.join(sorted(RESERVED))}"
        return f"'{name}' cannot be the name of a further attribute", remedy
    wrong = None if is_number(value) else text_problem(value)
    if wrong or (isinstance(value, numbers.Integral) and abs(int(value)) >= 2**63):
        return wrong or f"{value} does not fit 64 bits", "an attribute is one line of text or one number"
    return None


def _about_problem(header: Header) -> tuple[str, str, str] | None:
    wrong = None if header.title is None else text_problem(header.title)
    if wrong:
        return "attribute title", wrong, "the title is one line of text"
    if header.source is not None and header.source not in ORIGINS:
        return "attribute source", f"it is '{header.source}'", f"allowed: {', '.join(ORIGINS)}"
    problem = None if header.created is None else created_problem(header.created)
    if problem:
        return "attribute created", *problem
    for name, value in header.attributes.items():
        problem = attribute_problem(name, value)
        if problem:
            return f"attribute {name}", *problem
    return None
