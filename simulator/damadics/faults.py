"""The 19 faults of the benchmark: what each is, how strong it can be, and how it develops in time.

Source: Bartyś & Syfert, *Using Damadics Actuator Benchmark Library*, v1.22, 2002; Syfert et al., *Benchmark
Definition*, v1.0, 2002.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from recordings import Array, BadInput
from simulator.damadics.actuator.parameters import STEP

LEVELS: Mapping[str, float] = MappingProxyType({"small": 0.25, "medium": 0.5, "big": 0.75, "incipient": 1.0})
"""Strengths of the benchmark's faults [1]; an incipient fault grows to its strength."""

STEPS_PER_SECOND = round(1 / STEP)


@dataclass(frozen=True)
class FaultKind:
    """One of the 19 faults.

    name : what it is; component : where; both_ways : whether strengths from -1 are possible, else from 0;
    direction : the benchmark's sign; modes : the benchmark's levels of it; development_s : of the incipient fault [s].
    """

    number: int
    name: str
    component: str
    modes: tuple[str, ...]
    both_ways: bool = False
    direction: int = 1
    development_s: float = 0.0

    @property
    def lower(self) -> float:
        """The lowest signed strength."""
        return -1.0 if self.both_ways else 0.0


_ABRUPT, _DAY, _HOUR = ("small", "medium", "big"), 86400.0, 3600.0
_KINDS = (
    FaultKind(1, "valve clogging", "valve", _ABRUPT),
    FaultKind(2, "plug or seat sedimentation", "valve", ("big", "incipient"), development_s=_DAY),
    FaultKind(3, "plug or seat erosion", "valve", ("incipient",), development_s=_DAY),
    FaultKind(4, "friction of valve or bushing", "valve", ("incipient",), both_ways=True, development_s=_HOUR),
    FaultKind(5, "external leakage", "valve", ("incipient",), development_s=_DAY),
    FaultKind(6, "internal leakage", "valve", ("incipient",), development_s=_DAY),
    FaultKind(7, "evaporation or critical flow", "valve", _ABRUPT),
    FaultKind(8, "twisted rod", "servomotor", _ABRUPT),
    FaultKind(9, "leak of housing or terminals", "servomotor", ("incipient",), development_s=_DAY),
    FaultKind(10, "perforated diaphragm", "servomotor", _ABRUPT),
    FaultKind(11, "spring", "servomotor", ("big", "incipient"), development_s=_DAY),
    FaultKind(12, "E/P transducer", "positioner", _ABRUPT, both_ways=True, direction=-1),
    FaultKind(
        13, "rod displacement sensor", "positioner", (*_ABRUPT, "incipient"), both_ways=True, development_s=900.0
    ),
    FaultKind(14, "pressure sensor", "positioner", _ABRUPT, both_ways=True, direction=-1),
    FaultKind(15, "positioner feedback", "positioner", ("big",)),
    FaultKind(16, "supply pressure drop", "general", _ABRUPT),
    FaultKind(17, "unexpected pressure change", "general", ("big", "incipient"), both_ways=True, development_s=_HOUR),
    FaultKind(18, "opened bypass", "general", (*_ABRUPT, "incipient"), development_s=_DAY),
    FaultKind(19, "flow sensor", "general", _ABRUPT, both_ways=True, direction=-1),
)
FAULTS: Mapping[int, FaultKind] = MappingProxyType({kind.number: kind for kind in _KINDS})
"""The faults by number."""


@dataclass(frozen=True)
class Fault:
    """One fault over a run: absent before `start_s`, growing over `development_s` to `strength`, gone from `stop_s` on.

    number : 1 to 19; strength : final, 0 to 1, without sign; direction : 1 or -1, the benchmark's where not given;
    start_s, development_s, stop_s [s].

    Raises `BadInput` for an unknown number, a strength or direction the fault cannot have, or impossible times.

    >>> Fault(4, start_s=70, development_s=20).signed(np.array([69.0, 80.0, 95.0])).tolist()
    [0.0, 0.5, 1.0]
    """

    number: int
    strength: float = 1.0
    start_s: float = 0.0
    development_s: float = 0.0
    stop_s: float = math.inf
    direction: int | None = None

    def __post_init__(self) -> None:
        problem = _number_problem(self.number) or _strength_problem(self) or _time_problem(self)
        if problem:
            raise BadInput(f"fault f{self.number}", *problem)

    @classmethod
    def of_level(cls, number: int, level: str, start_s: float = 0.0, stop_s: float = math.inf) -> Fault:
        """A fault of a level of `LEVELS`; an incipient one takes the benchmark's development time.

        >>> Fault.of_level(13, "incipient", start_s=900.0).development_s
        900.0
        """
        if level not in LEVELS:
            raise BadInput(f"fault f{number}", f"there is no level '{level}'", f"levels: {', '.join(LEVELS)}")
        known, slow = number in FAULTS, level == "incipient"
        return cls(number, LEVELS[level], start_s, FAULTS[number].development_s if known and slow else 0.0, stop_s)

    @property
    def kind(self) -> FaultKind:
        """Which fault it is."""
        return FAULTS[self.number]

    @property
    def sign(self) -> int:
        """Its direction, 1 or -1."""
        return self.kind.direction if self.direction is None else self.direction

    def signed(self, t: Array) -> Array:
        """Signed strength at times t, shape (n,) [s]."""
        grown = np.ones_like(t) if self.development_s == 0 else np.minimum(1.0, (t - self.start_s) / self.development_s)
        active = (t >= self.start_s) & (t < self.stop_s)
        return np.where(active, self.sign * self.strength * grown, 0.0)


def strengths(faults: Iterable[Fault], t: Array) -> Array:
    """Signed strengths of all 19 faults at times t (n,) [s], (n, 19); those of one number add up to its limits."""
    columns = np.zeros((len(t), len(FAULTS)))
    for fault in faults:
        columns[:, fault.number - 1] += fault.signed(t)
    return limited(columns)


def limited(columns: Array) -> Array:
    """Signed strengths (n, 19) limited to what each fault can be; the array itself when there is nothing to limit."""
    if not columns.any():
        return columns
    limits = columns.copy()
    for number in np.flatnonzero(columns.any(axis=0)):
        limits[:, number] = np.clip(columns[:, number], _KINDS[number].lower, 1.0)
    return limits


def _number_problem(number: int) -> tuple[str, str] | None:
    if number in FAULTS:
        return None
    return "there is no such fault", f"faults are numbered 1 to {len(FAULTS)}"


def _strength_problem(fault: Fault) -> tuple[str, str] | None:
    if not 0 <= fault.strength <= 1:
        return f"the strength is {fault.strength:g}", "a strength is 0 to 1, its sign is the direction"
    if fault.sign not in (1, -1):
        return f"the direction is {fault.sign}", "a direction is 1 or -1"
    if fault.sign < 0 and not fault.kind.both_ways:
        return "the direction is -1", f"'{fault.kind.name}' has the direction 1 only"
    return None


def _time_problem(fault: Fault) -> tuple[str, str] | None:
    for name, value in (("start", fault.start_s), ("development time", fault.development_s)):
        if not (math.isfinite(value) and value >= 0):
            return f"the {name} is {value:g} s", "times are finite and not negative"
    if not fault.stop_s >= fault.start_s:
        return f"it stops at {fault.stop_s:g} s and starts at {fault.start_s:g} s", "a fault stops after it starts"
    return None
