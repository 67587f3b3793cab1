"""A sample of a source as the detector takes it: the signals that it uses, in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from detector import WATCHED, Measurement
from hil.source.sample import Sample
from recordings import LARGEST, BadInput, Signal, SignalSpec


class SampleConverter:
    """Turns the samples of one valve into measurements; a value that is not good becomes NaN.

    valve : its name; signals : what its samples bring; stroke_m : [m], for a position in % or as a share. Raises
    BadInput when there is no position, or a unit that cannot be turned into SI.
    """

    def __init__(self, valve: str, signals: Sequence[SignalSpec], stroke_m: float | None) -> None:
        self._scales: dict[str, tuple[float, float]] = {}
        for spec in signals:
            if spec.name in WATCHED:
                both = Signal(spec.name, np.array([0.0, 1.0]), spec.unit, spec.role).si(stroke_m).values
                self._scales[spec.name] = (float(both[1] - both[0]), float(both[0]))
        if "position" not in self._scales:
            there = ", ".join(spec.name for spec in signals)
            raise BadInput(f"valve {valve}", f"its position is not read; there are {there}", "name it in the map")

    @property
    def names(self) -> tuple[str, ...]:
        """The signals of a measurement."""
        return tuple(self._scales)

    def measurement(self, sample: Sample, time_s: float) -> Measurement:
        """The measurement of a sample at a time of the detector's clock [s]."""
        values = {}
        for name, (scale, offset) in self._scales.items():
            reading = sample.readings.get(name)
            value = math.nan if reading is None else reading.usable * scale + offset
            values[name] = value if abs(value) <= LARGEST else math.nan  # a device may say anything
        return Measurement(time_s, values)
