"""The valves of a fleet side by side: whose friction grows, whose spring changed, who is known badly, who is odd."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bristle.fleet.estimates import FleetQuantity, moment, quantities
from bristle.fleet.work import Row
from identification.population import EstimateChange, Outlyingness, Pooled, Trend, change, outliers, pooled, trend

FRICTION, SPRING = "lugre.fc", "spring.K"

RATE = 0.05
"""The false-discovery rate of what is told, for each quantity of each type of valve."""


@dataclass(frozen=True)
class RankedValve:
    """A valve over its recordings.

    last : row of the newest; friction : trend of its logarithm, a year; spring : change of the logarithm of its rate
    from first to last; weakest : the parameter that is known worst, and its relative error.
    """

    valve: str
    last: Row
    recordings: int
    friction: Trend | None
    spring: EstimateChange | None
    weakest: tuple[str, float] | None


@dataclass(frozen=True)
class TypeOfValve:
    """What the valves of one type have in common. valves : their tags, newest row of each in the order of `rows`."""

    kind: str
    rows: Sequence[Row]
    quantities: Sequence[FleetQuantity]
    outliers: Mapping[str, Outlyingness] = field(default_factory=dict)
    pooled: Mapping[str, Pooled] = field(default_factory=dict)


def ranked(rows: Sequence[Row]) -> list[RankedValve]:
    """Every valve with its history, in the order of tags."""
    return [_valve(valve, history) for valve, history in _histories(rows).items()]


def types_of_valves(rows: Sequence[Row], rate: float = RATE) -> list[TypeOfValve]:
    """Valves by type, with outliers at a false-discovery rate and pooled estimates; the newest row of each valve."""
    newest = [history[-1] for history in _histories(rows).values()]
    kinds = sorted({str(row["type"] or "") for row in newest if row["state"] == "done"})
    return [
        _type(kind, [r for r in newest if r["state"] == "done" and (r["type"] or "") == kind], rate) for kind in kinds
    ]


def _type(kind: str, rows: Sequence[Row], rate: float) -> TypeOfValve:
    found = quantities(rows)
    odd = {one.name: outliers(*one.scaled, rate) for one in found}
    return TypeOfValve(kind, rows, found, odd, dict(_pooled(found)))


def _pooled(found: Sequence[FleetQuantity]) -> Iterator[tuple[str, Pooled]]:
    """Pooled estimates of the quantities that every valve of the type has, with an error."""
    for one in found:
        together = pooled(*one.scaled)
        if together is not None:
            yield one.name, together


def _histories(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """The rows of each valve by time; without dates, by the names of the recordings."""
    histories: dict[str, list[Row]] = {}
    for row in sorted(rows, key=lambda row: (row["valve"], row["date"] or "", row["recordings"])):
        histories.setdefault(row["valve"], []).append(row)
    return histories


def _valve(valve: str, history: Sequence[Row]) -> RankedValve:
    done = [row for row in history if row["state"] == "done"]
    by_name = {one.name: one for one in quantities(done)}
    at = np.array([moment(row) for row in done])
    last = history[-1]
    return RankedValve(
        valve, last, len(history), _trend(by_name.get(FRICTION), at), _change(by_name.get(SPRING)), _weakest(last)
    )


def _usable(quantity: FleetQuantity) -> np.ndarray:
    return np.isfinite(quantity.values) & (quantity.errors > 0.0)


def _trend(friction: FleetQuantity | None, at: np.ndarray) -> Trend | None:
    if friction is None or not friction.logarithmic:
        return None
    values, errors = friction.scaled
    kept = _usable(friction) & np.isfinite(at)
    return trend(at[kept], values[kept], errors[kept])


def _change(spring: FleetQuantity | None) -> EstimateChange | None:
    if spring is None or not spring.logarithmic:
        return None
    values, errors = spring.scaled
    kept = np.flatnonzero(_usable(spring))
    if len(kept) < 2:
        return None
    first, last = kept[0], kept[-1]
    return change(values[first], errors[first], values[last], errors[last])


def _weakest(row: Row) -> tuple[str, float] | None:
    """The parameter whose error is largest against its value; one without an error that should have one is worst."""
    found = []
    for name in [name.removesuffix(".status") for name in row if name.endswith(".status")]:
        value, std = row.get(name), row.get(f"{name}.std")
        if row[f"{name}.status"] in (None, "given") or not value:
            continue
        found.append((name, float("inf") if std is None else abs(std / value)))
    return max(found, key=lambda one: one[1], default=None)
