"""A sample of a source as the detector takes it: the signals it looks at, in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from detector import USED, Row
from hil.source.sample import Sample
from recordings import BadInput, Signal, SignalSpec


class RowMaker:
    """Turns samples of one valve into rows; what is not good is missing.

    valve : its name; signals : what its samples bring; stroke_m : [m], for a position in % or as a share. Raises
    BadInput when there is no position, or a unit that cannot be turned into SI.
    """

    def __init__(self, valve: str, signals: Sequence[SignalSpec], stroke_m: float | None) -> None:
        self._scales: dict[str, tuple[float, float]] = {}
        for spec in signals:
            if spec.name in USED:
                both = Signal(spec.name, np.array([0.0, 1.0]), spec.unit, spec.role).si(stroke_m).values
                self._scales[spec.name] = (float(both[1] - both[0]), float(both[0]))
        if "position" not in self._scales:
            there = ", ".join(spec.name for spec in signals)
            raise BadInput(f"valve {valve}", f"its position is not read; there are {there}", "name it in the map")

    def lacks(self, names: Sequence[str]) -> list[str]:
        """Which of these signals never come."""
        return [name for name in names if name not in self._scales]

    def row(self, sample: Sample, time_s: float) -> Row:
        """The row of a sample at a time of the detector's clock [s]."""
        values = {}
        for name, (scale, offset) in self._scales.items():
            reading = sample.readings.get(name)
            values[name] = math.nan if reading is None else reading.usable * scale + offset
        return Row(time_s, values)
