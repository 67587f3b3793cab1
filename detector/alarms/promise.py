"""What fault-free time supports, and in which words it is said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

DAY_S = 86400.0
MONTH_S = 30 * DAY_S

REACH = 1000.0
"""One alarm in so many times the learned time is promised at most: as far as the declared margins were tried."""

REACH_CHANGING = 100.0
"""The same where the data show that their mean drifts or their size changes."""


@dataclass(frozen=True)
class Promise:
    """How often an alarm comes without a fault at most: one in interval_s [s] on average, after seconds [s] without a
    fault; wish_s [s] : the interval that was asked for; reach : interval over learned time; findings : of the data.

    >>> Promise.of(80.0, 30 * 86400.0).sentence
    'false alarms: 80 s fault-free support at most one in 22 hours; for one in 30 days it needs about 43 minutes'
    """

    interval_s: float
    seconds: float
    wish_s: float
    reach: float
    findings: tuple[str, ...] = ()

    @classmethod
    def of(cls, seconds: float, wish_s: float, findings: Sequence[str] = ()) -> Promise:
        """What so many fault-free seconds support."""
        reach = REACH_CHANGING if findings else REACH
        return cls(min(reach * seconds, wish_s), seconds, wish_s, reach, tuple(findings))

    def after(self, seconds: float) -> Promise:
        """The same after more fault-free time."""
        return Promise.of(seconds, self.wish_s, self.findings)

    @property
    def per_month(self) -> float:
        """Alarms a month at most."""
        return MONTH_S / self.interval_s

    @property
    def kept(self) -> bool:
        """Whether it is what was asked for."""
        return self.interval_s >= self.wish_s

    @property
    def sentence(self) -> str:
        """In words."""
        found = f", because {' and '.join(self.findings)}" if self.findings else ""
        said = f"false alarms: {words(self.seconds)} fault-free support at most one in {words(self.interval_s)}{found}"
        if self.kept:
            return f"{said}, as wished"
        return f"{said}; for one in {words(self.wish_s)} it needs about {words(self.wish_s / self.reach)}"

    @property
    def plain(self) -> str:
        """For whoever runs the plant: what to expect, and what it takes to have better.

        >>> Promise.of(80.0, MONTH_S).plain.partition(":")[0]
        'While the valve is in good order, expect at most one false alarm in 22 hours on average'
        """
        often = words(self.interval_s)
        said = f"While the valve is in good order, expect at most one false alarm in {often} on average"
        if self.kept:
            return f"{said}, as wished."
        needed = self.wish_s / self.reach
        later = "a day" if needed <= DAY_S else words(needed)
        return (
            f"{said}: {words(self.seconds)} of learning support no more. Learned from {words(needed)}, or after "
            f"{later} of watching without an alarm, it is one in {words(self.wish_s)}."
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return asdict(self) | {"findings": list(self.findings)}

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> Promise:
        """What `as_dict` gave."""
        return cls(**{**parts, "findings": tuple(parts["findings"])})


def words(seconds: float) -> str:
    """A time in words.

    >>> words(80.0), words(2592.0), words(6570.0), words(259200.0)
    ('80 s', '43 minutes', '110 minutes', '3 days')
    """
    for unit, name in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2.0 * unit:
            return f"{float(f'{seconds / unit:.2g}'):g} {name}"
    return f"{float(f'{seconds:.2g}'):g} s"
