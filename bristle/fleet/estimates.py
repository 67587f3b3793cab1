"""The quantities of a fleet as arrays: what was estimated of each valve, with its error, from the rows of results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from bristle.fleet.work import Row
from recordings import Array

HALF_95 = 1.96
"""Half of a 95 % interval, which tests and assessments give, of a normal distribution, in standard deviations."""


@dataclass(frozen=True)
class FleetQuantity:
    """One quantity of n rows. values, errors : shape (n,), NaN where there is none; error 0 where it is not known.

    logarithmic : whether all values are positive, so that they are compared, pooled and followed as logarithms.
    """

    name: str
    values: Array
    errors: Array

    @property
    def logarithmic(self) -> bool:
        """Whether all values that are there are positive."""
        there = self.values[np.isfinite(self.values)]
        return bool(len(there)) and bool(np.all(there > 0.0))

    @property
    def scaled(self) -> tuple[Array, Array]:
        """Values and errors on the scale on which they are about normal: logarithms where all are positive."""
        if not self.logarithmic:
            return self.values, self.errors
        return np.log(self.values), self.errors / self.values

    def back(self, scaled: float) -> float:
        """A scaled value in the unit of the quantity."""
        return float(np.exp(scaled)) if self.logarithmic else scaled


def quantities(rows: Sequence[Row]) -> list[FleetQuantity]:
    """What can be compared over rows: columns with a standard deviation or an interval beside them, by name."""
    columns = dict.fromkeys(name for row in rows for name in row)
    found = []
    for name in columns:
        if f"{name}.std" in columns:
            found.append(FleetQuantity(name, _column(rows, name), np.nan_to_num(_column(rows, f"{name}.std"))))
        elif name.endswith(".value") and f"{name.removesuffix('.value')}.lower" in columns:
            found.append(
                _with_interval(rows, name, *(f"{name.removesuffix('.value')}.{e}" for e in ("lower", "upper")))
            )
        elif f"{name}.low" in columns:
            found.append(_with_interval(rows, name, f"{name}.low", f"{name}.high"))
    return [one for one in found if np.isfinite(one.values).any()]


def moment(row: Row) -> float:
    """When a recording was made [s]; NaN where that is not known or no date."""
    try:
        at = datetime.fromisoformat(str(row["date"]))
    except ValueError:
        return float("nan")
    return (at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp()


def _with_interval(rows: Sequence[Row], name: str, low: str, high: str) -> FleetQuantity:
    width = _column(rows, high) - _column(rows, low)
    return FleetQuantity(name, _column(rows, name), np.nan_to_num(width / (2.0 * HALF_95)))


def _column(rows: Sequence[Row], name: str) -> Array:
    """Numbers of a column; a fixed parameter's standard deviation is not there, which is NaN."""
    values = [row.get(name) for row in rows]
    return np.array([float(value) if isinstance(value, int | float) else np.nan for value in values])
