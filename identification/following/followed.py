"""What became of a valve: the content of `follow.json`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.following.limit_crossing import LimitCrossing
from identification.shown_findings import ShownFindings
from recordings import ReportOpening, save_json

if TYPE_CHECKING:
    from identification.report.findings_page import Findings

MONTH = 30.44
"""Days."""


@dataclass(frozen=True)
class LevelOnDay:
    """A quantity after a recording. value, std : what it alone says; level, lower, upper : with all before it, 95 %."""

    date: datetime
    value: float
    std: float
    level: float
    lower: float
    upper: float


@dataclass(frozen=True)
class FollowedQuantity:
    """levels : one a recording; slope : median and ends of the 95 % interval, in a day; crossing : of the limit."""

    name: str
    unit: str
    levels: tuple[LevelOnDay, ...]
    slope: tuple[float, float, float]
    crossing: LimitCrossing | None

    def date(self, days: float | None) -> datetime | None:
        """The date so many days after the last recording."""
        return None if days is None else self.levels[-1].date + timedelta(days=days)

    @property
    def crossing_dates(self) -> tuple[datetime | None, datetime | None, datetime | None]:
        """When the limit is crossed: median and ends of the 95 % interval; None where it is not certain that it is."""
        if self.crossing is None:
            return None, None, None
        median, lower, upper = (self.date(one) for one in self.crossing.days)
        return median, lower, upper

    def words(self) -> list[str]:
        """The quantity in sentences."""
        now, (slope, low, high) = self.levels[-1], (MONTH * one for one in self.slope)
        found = [
            f"{self.name}: {now.level:.4g} {self.unit} ({now.lower:.4g} to {now.upper:.4g}) on {now.date:%Y-%m-%d}, "
            f"{slope:+.2g} a month ({low:+.2g} to {high:+.2g})"
        ]
        if self.crossing is not None:
            found.append(self._crossing_words(self.crossing))
        return found

    def _crossing_words(self, met: LimitCrossing) -> str:
        limit = f"{self.name}: the limit {met.limit:.4g} {self.unit}"
        if met.crossed:
            return f"{limit} is crossed already"
        median, lower, upper = (None if one is None else f"{one:%Y-%m-%d}" for one in self.crossing_dates)
        if lower is None:
            return f"{limit} is hardly crossed within ten years (probability {met.probability:.2f})"
        if median is None:
            chance = f"with a probability of {met.probability:.2f}"
            return f"{limit} is crossed within ten years {chance}, not before {lower}"
        return f"{limit} is crossed on {median} ({lower} to {upper or 'not within ten years'})"


@dataclass(frozen=True, repr=False)
class FollowedValve(ShownFindings):
    """What became of a valve. quantities : by name; recordings : labels in the order of their dates; problems : limits
    of quantities that do not show.
    """

    quantities: Mapping[str, FollowedQuantity]
    recordings: tuple[str, ...]
    problems: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """The content of `follow.json`."""
        return {
            "format": "valve-history", "version": 1, "recordings": list(self.recordings),
            "quantities": {name: _plain(one) for name, one in self.quantities.items()},
            "problems": list(self.problems),
        }  # fmt: skip

    def lines(self) -> list[str]:
        """The answer in lines for a terminal."""
        return [*(line for one in self.quantities.values() for line in one.words()), *self.problems]

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `follow.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_json(Path(path), self.as_json())

    def findings(self) -> Findings:
        """What its page shows."""
        from identification.report.findings_page import Findings

        curves = {}
        for name, one in self.quantities.items():
            days = np.array([(level.date - one.levels[0].date).total_seconds() / 86400 for level in one.levels])
            lines = [
                (words, days, np.array([getattr(level, field) for level in one.levels]))
                for words, field in (("recording", "value"), ("level", "level"), ("lower end, 95 %", "lower"))
            ]
            curves[name] = (f"days from {one.levels[0].date:%Y-%m-%d}", one.unit, lines)
        rows = [
            (
                name,
                f"{one.date:%Y-%m-%d}",
                f"{one.value:.4g}",
                f"{one.level:.4g}",
                f"{one.lower:.4g}",
                f"{one.upper:.4g}",
            )
            for name, each in self.quantities.items()
            for one in each.levels
        ]
        table = (("quantity", "date", "recording", "level", "lower", "upper"), rows)
        return Findings("A valve over time", "Valve", tuple(self.lines()), (table,), curves, self._opening())

    def _opening(self) -> ReportOpening:
        """What to do first: repair what is beyond its limit, look again before the first date that may cross one."""

        sure = f"{len(self.recordings)} recordings; intervals of 95 %"
        beyond = [name for name, one in self.quantities.items() if one.crossing is not None and one.crossing.crossed]
        if beyond:
            return ReportOpening("repair", f"beyond the limit: {', '.join(beyond)}", sure, "plan work on the valve")
        first = min((one.crossing_dates[1] for one in self.quantities.values() if one.crossing_dates[1]), default=None)
        if first is not None:
            return ReportOpening("watch", "a limit may be crossed", sure, f"test again before {first:%Y-%m-%d}")
        if self.problems:
            return ReportOpening("watch", "not every limit can be judged", sure, "record what is missing")
        return ReportOpening("good", "no limit is near", sure, "nothing; go on recording")


def _plain(one: FollowedQuantity) -> dict[str, Any]:
    median, low, high = one.slope
    levels = [
        {
            "date": each.date.isoformat(), "value": each.value, "std": each.std, "level": each.level,
            "lower": each.lower, "upper": each.upper,
        }
        for each in one.levels
    ]  # fmt: skip
    slope = {"value": median, "lower": low, "upper": high}
    return {"unit": one.unit, "levels": levels, "slope_per_day": slope, "limit": _plain_crossing(one)}


def _plain_crossing(one: FollowedQuantity) -> dict[str, Any] | None:
    if one.crossing is None:
        return None
    median, lower, upper = (None if date is None else date.isoformat() for date in one.crossing_dates)
    return {
        "limit": one.crossing.limit, "crossed": one.crossing.crossed, "probability": one.crossing.probability,
        "date": median, "lower": lower, "upper": upper,
    }  # fmt: skip
