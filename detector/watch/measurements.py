"""The signals of one valve over time by name, in SI units, as the detector learns from them and watches them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from recordings import Array, BadInput, Recording

INPUTS = ("force", "setpoint", "pressure", "drive")
"""What may stand for the input u of the observer."""

USED = (
    "position", *INPUTS, "supply_pressure", "upstream_pressure", "downstream_pressure", "flow", "mass_flow",
)  # fmt: skip
"""The signals that the detector looks at, where they are measured."""


@dataclass(frozen=True, slots=True)
class Row:
    """One moment: time_s [s], rising, of any origin; values by name in SI units, NaN where there is none."""

    time_s: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Measurements:
    """Many moments: time_s (n_samples,) [s]; values by name, each (n_samples,), SI units, NaN where there is none."""

    time_s: Array
    values: Mapping[str, Array]

    @classmethod
    def recorded(cls, recording: Recording) -> Measurements:
        """The signals of a recording that the detector looks at. Raises BadInput when there is no position."""
        if "position" not in recording:
            raise BadInput(recording.label, "it has no position", "the detector needs the position of the stem")
        values = {name: recording.si(name).values for name in USED if name in recording}
        return cls(recording.time, values)

    @classmethod
    def of(cls, rows: Sequence[Row]) -> Measurements:
        """From single moments, all with the signals of the first."""
        names = list(rows[0].values) if rows else []
        columns = {name: np.array([row.values[name] for row in rows]) for name in names}
        return cls(np.array([row.time_s for row in rows]), columns)

    def __len__(self) -> int:
        return len(self.time_s)

    def __contains__(self, name: object) -> bool:
        """Whether a signal is there and has a value at least half of the time."""
        return name in self.values and bool(np.mean(np.isfinite(self.values[str(name)])) > 0.5)

    def __getitem__(self, part: slice) -> Measurements:
        return Measurements(self.time_s[part], {name: column[part] for name, column in self.values.items()})

    def __iter__(self) -> Iterator[Row]:
        columns = {name: column.tolist() for name, column in self.values.items()}
        for i, moment in enumerate(self.time_s.tolist()):
            yield Row(moment, {name: column[i] for name, column in columns.items()})

    def until(self, seconds: float) -> Measurements:
        """The part up to `seconds` after the first sample."""
        return self[: int(np.searchsorted(self.time_s, self.time_s[0] + seconds, side="left"))]
