"""Which samples the observer uses: here alone NaN, outliers, stale values, gaps and clocks that jump are found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import fabs, isfinite

import numpy as np

from detector.arithmetic.native import inlined, native
from recordings import Array, Integers

LARGEST = 1e9
"""No position, velocity or input of a valve is larger in any unit; beyond it a number is an outlier."""

LEAST_STEP = 1e-6
"""Samples closer than this [s] are one sample: their difference quotient would be rounding."""

PATIENCE = 3
"""After so many implausible samples in a row the next is believed: the valve, or its clock, really is elsewhere."""


class SampleVerdict(IntEnum):
    """What the observer made of a sample. Up to GAP it was used; from NOT_FINITE on it was skipped.

    A source that distrusts a sample itself says so with STALE or BAD, and with USED (0) that it is good.
    """

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
        return self <= SampleVerdict.GAP


@dataclass(frozen=True)
class Screening:
    """What is plausible. gap_s : a longer silence [s] restarts the errors; position, input : lowest and highest
    plausible value; top_speed : fastest plausible change of position, per second.
    """

    gap_s: float = 2.5
    position: tuple[float, float] = (-LARGEST, LARGEST)
    input: tuple[float, float] = (-LARGEST, LARGEST)
    top_speed: float = LARGEST / LEAST_STEP

    def limits(self) -> Array:
        """The six numbers as the compiled screen takes them, (6,)."""
        return np.array([self.gap_s, *self.position, *self.input, self.top_speed])


USED, START, GAP, NOT_FINITE, BAD, STALE, OUTLIER = (int(verdict) for verdict in SampleVerdict)
"""Plain numbers of the verdicts, as compiled functions take them."""

LAST_TIME, LAST_POSITION, RUNNING, RUN_OF_OUTLIERS = range(4)
"""Places in the state of the screen, which starts as zeros."""

N_SCREEN = 4

Seen = tuple[float, float, float, float]
"""That state in scalars."""


@native
def screen(
    state: Array, limits: Array, time: Array, position: Array, u: Array, velocity: Array, quality: Integers,
    measured: bool, dt: Array, verdict: Integers,
) -> None:  # fmt: skip
    """Screen samples in a row, changing `state` (4,) in place.

    quality : what the source says, as in `Observer.run`; measured : whether the velocity is needed; dt : time since
    the last used sample [s], 0 at a start, NaN when the sample is skipped; verdict : of `SampleVerdict`.
    """
    for i in range(time.shape[0]):
        x, v = position[i], velocity[i] if measured else 0.0
        plausible = limits[1] <= x <= limits[2] and limits[3] <= u[i] <= limits[4]
        verdict[i], dt[i], seen = screened(
            time[i], x, u[i], v, quality[i], plausible,
            (state[LAST_TIME], state[LAST_POSITION], state[RUNNING], state[RUN_OF_OUTLIERS]), limits[0], limits[5],
        )  # fmt: skip
        state[LAST_TIME], state[LAST_POSITION], state[RUNNING], state[RUN_OF_OUTLIERS] = seen


@inlined
def screened(
    t: float, x: float, u: float, v: float, quality: int, plausible: bool, seen: Seen, gap: float, top_speed: float
) -> tuple[int, float, Seen]:
    """One sample: its verdict, the time since the last used one [s] as `screen` has it, and the state after it.

    In scalars, so that a fleet can afford it. plausible : whether position and input are within their ranges; seen :
    the state before.
    """
    time, position, running, outliers = seen
    elapsed = t - time
    verdict = sample_verdict(t, x, u, v, quality, plausible, elapsed, x - position, running, outliers, gap, top_speed)
    if verdict > GAP:
        more = 1.0 if verdict == OUTLIER else 0.0
        return verdict, np.nan, (time, position, running, outliers + more)
    return verdict, elapsed if verdict == USED else 0.0, (t, x, 1.0, 0.0)


@inlined
def sample_verdict(
    t: float, x: float, u: float, v: float, quality: int, plausible: bool, elapsed: float, moved: float,
    running: float, outliers: float, gap: float, top_speed: float,
) -> int:  # fmt: skip
    """The verdict on one sample, as a number of `SampleVerdict`.

    plausible : as in `screened`; elapsed [s], moved : since the last used sample.
    """
    if not (isfinite(t) and isfinite(x) and isfinite(u) and isfinite(v)):
        return NOT_FINITE
    if quality != USED:
        return STALE if quality == STALE else BAD
    if not plausible or max(fabs(x), fabs(u), fabs(v)) > LARGEST:
        return OUTLIER
    if running == 0.0:
        return START
    if fabs(elapsed) > gap:
        return GAP
    if elapsed < LEAST_STEP:
        return STALE
    if fabs(moved) > top_speed * elapsed:
        return GAP if outliers >= PATIENCE else OUTLIER
    return USED
