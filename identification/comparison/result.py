"""What a comparison says: every quantity before and after, and whether it changed."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from recordings import Array, save_json


def shared_tag(before: Mapping[str, object], after: Mapping[str, object]) -> str | None:
    """The tag that two descriptions of a plant give the valve; None where they give none, or two."""
    tag, other = before.get("tag"), after.get("tag")
    return str(tag) if tag and (other is None or tag == other) else None


@dataclass(frozen=True)
class ComparedValue:
    """A value and its standard deviation, by what differed from stroke to stroke or by the fit."""

    value: float
    std: float


@dataclass(frozen=True)
class Difference:
    """A quantity before and after, in `unit`. difference : after less before; lower, upper : its interval, at the level
    of all quantities together; changed : whether that leaves out zero.
    """

    name: str
    unit: str
    before: ComparedValue
    after: ComparedValue
    lower: float
    upper: float

    @property
    def difference(self) -> float:
        """After less before."""
        return self.after.value - self.before.value

    @property
    def changed(self) -> bool:
        """Whether the difference is beyond noise and repeatability."""
        return not self.lower <= 0.0 <= self.upper

    @property
    def sentence(self) -> str:
        """The difference in words."""
        much = f"{self.difference:+.3g} {self.unit} ({self.lower:+.3g} to {self.upper:+.3g})"
        share = f", {100 * self.difference / abs(self.before.value):+.1f} %" if self.before.value else ""
        return f"{self.name}: {self.before.value:.4g} before, {self.after.value:.4g} {self.unit} after: {much}{share}"


@dataclass(frozen=True)
class ComparedCurve:
    """A line to draw: x (n,) and y (n,) in the units of the picture's axes; bars : half widths of intervals of y."""

    name: str
    x: Array
    y: Array
    bars: Array | None = None


@dataclass(frozen=True)
class ComparedPicture:
    """Curves before and after over the same axes."""

    title: str
    x_label: str
    y_label: str
    before: Sequence[ComparedCurve]
    after: Sequence[ComparedCurve]


@dataclass(frozen=True)
class ComparisonResult:
    """Two recordings or models of one valve compared.

    kind : what was compared; before, after : names of the files; quantities : in the order of the table; places : of a
    changed friction, low and high end [m] with the friction before and after [N]; notes : what limits the answer;
    level : probability that anything at all is called changed where nothing is; alike : whether the tests are;
    tag : of the valve, None where the files do not agree on one.
    """

    kind: Literal["recordings", "models"]
    before: str
    after: str
    quantities: tuple[Difference, ...]
    places: tuple[tuple[float, float, float, float], ...]
    notes: tuple[str, ...]
    pictures: tuple[ComparedPicture, ...]
    level: float
    alike: bool
    tag: str | None = None

    @property
    def changed(self) -> tuple[str, ...]:
        """Names of what changed."""
        return tuple(q.name for q in self.quantities if q.changed)

    def sentences(self) -> list[str]:
        """The answer in words."""
        found = [q.sentence for q in self.quantities if q.changed]
        word = "Changed" if self.alike else "Changed, or tested differently"
        head = f"{word}: {', '.join(self.changed)}." if found else "Nothing changed beyond noise and repeatability."
        where = [
            f"friction between {1e3 * low:.1f} and {1e3 * high:.1f} mm: {before:.3g} N before, {after:.3g} N after"
            for low, high, before, after in self.places
        ]
        return [head, *found, *where, *self.notes]

    def as_json(self) -> dict[str, Any]:
        """The content of `compare.json`."""
        rows = [
            {
                "name": q.name, "unit": q.unit, "before": asdict(q.before), "after": asdict(q.after),
                "difference": q.difference, "lower": q.lower, "upper": q.upper, "changed": q.changed,
            }
            for q in self.quantities
        ]  # fmt: skip
        places = [
            {"from_m": low, "to_m": high, "friction_before_N": before, "friction_after_N": after}
            for low, high, before, after in self.places
        ]
        return {
            "format": "valve-comparison", "version": 1, "kind": self.kind, "before": self.before, "after": self.after,
            "changed": list(self.changed), "alike": self.alike, "level": self.level, "quantities": rows,
            "places": places, "notes": list(self.notes),
        }  # fmt: skip

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `compare.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_json(Path(path), self.as_json())
