"""What goes into the detector, and what is not fit to: NaN, outliers, stale values, gaps, clocks that jump."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from math import fabs, isfinite

import numpy as np
from numpy.typing import NDArray

from detector.arithmetic.native import Integers, native
from recordings import Array, BadInput, Recording

LARGEST = 1e9
"""No position, velocity or input of a valve is larger in any unit; beyond it a number is an outlier."""

LEAST_STEP = 1e-6
"""Samples closer than this [s] are one sample: their difference quotient would be rounding."""

PATIENCE = 3
"""So many implausible samples running are not outliers any more: the valve, or its clock, really is elsewhere."""


class Quality(IntEnum):
    """How far a sample can be trusted, as its source says."""

    GOOD = 0
    STALE = 1
    BAD = 2


class Verdict(IntEnum):
    """What the detector made of a sample. Up to GAP it was used; from NOT_FINITE on it was passed over."""

    USED = 0
    START = 1
    GAP = 2
    NOT_FINITE = 3
    BAD = 4
    STALE = 5
    OUTLIER = 6

    @property
    def used(self) -> bool:
        """Whether the sample entered the state."""
        return self <= Verdict.GAP


@dataclass(frozen=True, slots=True)
class Sample:
    """One moment of one valve. time_s [s] : rising, of any origin; position, input : in the units the observer was
    set up for; velocity : when it is measured, else NaN; quality : as the source says. NaN means there is no value.

    >>> Sample(0.1, position=0.019, input=0.5).quality.name
    'GOOD'
    """

    time_s: float
    position: float
    input: float
    velocity: float = math.nan
    quality: Quality = Quality.GOOD


@dataclass(frozen=True)
class Samples:
    """Many samples in a row, as arrays of one shape (n_samples,)."""

    time_s: Array
    position: Array
    input: Array
    velocity: Array
    quality: Integers

    @classmethod
    def of(
        cls,
        time_s: Sequence[float] | Array,
        position: Sequence[float] | Array,
        input: Sequence[float] | Array,
        velocity: Sequence[float] | Array | None = None,
        quality: Sequence[int] | Integers | None = None,
    ) -> Samples:
        """From any numbers; without velocity it is missing, without quality all are good. Raises BadInput."""
        t = np.array(time_s, float)
        speed = np.full(t.shape, math.nan) if velocity is None else np.array(velocity, float)
        trust = np.zeros(t.shape, np.int64) if quality is None else np.array(quality, np.int64)
        made = cls(t, np.array(position, float), np.array(input, float), speed, trust)
        for one in fields(cls):
            shape = getattr(made, one.name).shape
            if t.ndim != 1 or shape != t.shape:
                found = f"its shape is {shape}, the time's {t.shape}"
                raise BadInput(f"samples: {one.name}", found, "give one row of equal length each")
        return made

    @classmethod
    def row(cls, samples: Sequence[Sample]) -> Samples:
        """From single samples."""
        columns = [[getattr(sample, name) for sample in samples] for name in Sample.__slots__]
        return cls.of(*columns)

    @classmethod
    def recorded(cls, recording: Recording, input: str = "setpoint") -> Samples:
        """From a recording: its position, and the signal named `input`. Raises BadInput when one is missing."""
        for name in ("position", input):
            if name not in recording:
                raise BadInput(
                    f"recording: {name}", "there is no such signal", f"name one of {sorted(recording.signals)}"
                )
        velocity = recording["velocity"].values if "velocity" in recording else None
        return cls.of(recording.time, recording["position"].values, recording[input].values, velocity)

    def __len__(self) -> int:
        return len(self.time_s)

    def __getitem__(self, part: slice) -> Samples:
        rows = (self.time_s[part], self.position[part], self.input[part], self.velocity[part])
        return Samples(*rows, self.quality[part])


@dataclass(frozen=True)
class Screening:
    """What is plausible. gap_s : a longer silence [s] starts the errors anew; position, input : lowest and highest
    plausible value; top_speed : fastest plausible change of position, per second.
    """

    gap_s: float = 2.5
    position: tuple[float, float] = (-LARGEST, LARGEST)
    input: tuple[float, float] = (-LARGEST, LARGEST)
    top_speed: float = LARGEST / LEAST_STEP

    def limits(self) -> Array:
        """The six numbers as the compiled screen takes them."""
        return np.array([self.gap_s, *self.position, *self.input, self.top_speed])


_USED, _START, _GAP, _NOT_FINITE, _BAD, _STALE, _OUTLIER = (int(verdict) for verdict in Verdict)
_IS_GOOD, _IS_STALE = int(Quality.GOOD), int(Quality.STALE)
"""Plain numbers of the verdicts and qualities, as compiled functions take them."""

LAST_TIME, LAST_POSITION, RUNNING, RUN_OF_OUTLIERS = range(4)
"""Places in the state of the screen, which starts as zeros."""


@native
def screen(
    state: Array, limits: Array, time: Array, position: Array, u: Array, velocity: Array, quality: Integers,
    measured: bool, dt: Array, verdict: NDArray[np.int64],
) -> None:  # fmt: skip
    """Judge samples, changing `state` (4,) in place.

    measured : whether the velocity is needed; dt : time since the last used sample [s], 0 at a start, NaN when the
    sample is passed over; verdict : of `Verdict`.
    """
    for i in range(time.shape[0]):
        x, v = position[i], velocity[i] if measured else 0.0
        judged = judge(state, limits, time[i], x, u[i], v, quality[i])
        verdict[i] = judged
        if judged == _OUTLIER:
            state[RUN_OF_OUTLIERS] += 1.0
        if judged > _GAP:
            dt[i] = np.nan
            continue
        dt[i] = time[i] - state[LAST_TIME] if judged == _USED else 0.0
        state[LAST_TIME], state[LAST_POSITION], state[RUNNING], state[RUN_OF_OUTLIERS] = time[i], x, 1.0, 0.0


@native
def judge(state: Array, limits: Array, t: float, x: float, u: float, v: float, quality: int) -> int:
    """The verdict on one sample, as a number of `Verdict`."""
    if not (isfinite(t) and isfinite(x) and isfinite(u) and isfinite(v)):
        return _NOT_FINITE
    if quality != _IS_GOOD:
        return _STALE if quality == _IS_STALE else _BAD
    plausible = limits[1] <= x <= limits[2] and limits[3] <= u <= limits[4]
    if not plausible or max(fabs(x), fabs(u), fabs(v)) > LARGEST:
        return _OUTLIER
    if state[RUNNING] == 0.0:
        return _START
    elapsed = t - state[LAST_TIME]
    if fabs(elapsed) > limits[0]:
        return _GAP
    if elapsed < LEAST_STEP:
        return _STALE
    if fabs(x - state[LAST_POSITION]) > limits[5] * elapsed:
        return _GAP if state[RUN_OF_OUTLIERS] >= PATIENCE else _OUTLIER
    return _USED
