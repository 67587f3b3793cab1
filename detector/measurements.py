"""What the detector takes: the signals of one valve by name, in SI units, at one moment or at many."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from recordings import Array, BadInput, Recording

INPUTS = ("force", "setpoint", "pressure", "drive")
"""What may stand for the input u of the observer."""

WATCHED = (
    "position", *INPUTS, "supply_pressure", "upstream_pressure", "downstream_pressure", "flow", "mass_flow",
)  # fmt: skip
"""The signals that the detector uses, where they are measured."""

BREAK = 1000.0
"""Sampling times between two recordings that are joined: long enough to count as a gap."""


@dataclass(frozen=True, slots=True)
class Measurement:
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
        """The signals of a recording that the detector uses. Raises BadInput when there is no position."""
        if "position" not in recording:
            raise BadInput(recording.label, "it has no position", "the detector needs the position of the stem")
        values = {name: recording.si(name).values for name in WATCHED if name in recording}
        return cls(recording.time, values)

    @classmethod
    def joined(cls, recordings: Sequence[Recording]) -> Measurements:
        """Recordings of one valve one after the other, from time 0 on, with a gap between two.

        Raises BadInput for no recording, for one without a position, and when their signals differ.
        """
        if not recordings:
            raise BadInput("recordings", "there is none", "give one at least")
        parts = [cls.recorded(one) for one in recordings]
        for recording, part in zip(recordings, parts, strict=True):
            if set(part.values) != set(parts[0].values):
                found = f"its signals are not those of {recordings[0].label}"
                raise BadInput(recording.label, found, "give recordings of the same signals")
        times, end = [], 0.0
        for part in parts:
            times.append(part.time_s - part.time_s[0] + end)
            end = float(times[-1][-1]) + BREAK * float(np.median(np.diff(part.time_s)))
        values = {name: np.concatenate([part.values[name] for part in parts]) for name in parts[0].values}
        return cls(np.concatenate(times), values)

    @classmethod
    def of(cls, moments: Sequence[Measurement]) -> Measurements:
        """From single moments, all with the signals of the first."""
        names = list(moments[0].values) if moments else []
        columns = {name: np.array([one.values[name] for one in moments]) for name in names}
        return cls(np.array([one.time_s for one in moments]), columns)

    def __len__(self) -> int:
        return len(self.time_s)

    def __contains__(self, name: object) -> bool:
        """Whether a signal is there and has a value at least half of the time."""
        return name in self.values and bool(np.mean(np.isfinite(self.values[str(name)])) > 0.5)

    def __getitem__(self, part: slice) -> Measurements:
        return Measurements(self.time_s[part], {name: column[part] for name, column in self.values.items()})

    def __iter__(self) -> Iterator[Measurement]:
        columns = {name: column.tolist() for name, column in self.values.items()}
        for i, moment in enumerate(self.time_s.tolist()):
            yield Measurement(moment, {name: column[i] for name, column in columns.items()})
