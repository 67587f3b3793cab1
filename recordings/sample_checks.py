"""What the values of a recording must satisfy: the clock only goes forward, a signal that matters holds numbers.

Works in blocks, so that checking ten million samples needs a few megabytes beside them.
"""

from __future__ import annotations

import numpy as np

from recordings.arrays import Array
from recordings.signal import Role

_BLOCK = 1 << 18

QUALITIES = ("good", "stale", "out of range", "not valid", "link")
"""What a value is, by its code in a recording of version 2."""
NOT_KNOWN = 255
"""The code where the disk did not keep the quality."""

LARGEST = 1e30
"""Larger numbers measure nothing, and overflow where they are multiplied."""
SHORTEST_STEP_S, LATEST_S = 1e-9, 1e11
"""Nothing is sampled faster than that; a clock beyond 3000 years counts milliseconds or less."""

ALL_MISSING = "every sample is missing (NaN)"
"""Found of an input or output without one number: nothing can be computed with it, but it can be kept and looked at."""

TIME_REMEDY = "time is finite and strictly increasing; sort the rows and drop repeated ones"


def time_fault(time: Array, before: float = -np.inf) -> tuple[int, str] | None:
    """The first sample, shape (n_samples,), at which a clock is not finite or does not go forward, and how.

    before : time of the sample ahead of the first, in the unit of `time`.

    >>> time_fault(np.array([0.0, 0.1, 0.1]))
    (2, 'time repeats at sample 2: 0.1 after 0.1')
    """
    for start in range(0, len(time), _BLOCK):
        block = np.concatenate(([before], time[start : start + _BLOCK]))
        with np.errstate(invalid="ignore"):
            good = np.isfinite(block[1:]) & (block[1:] > block[:-1])
        if not good.all():
            first = int(np.argmin(good))
            return start + first, _describe(start + first, float(block[first]), float(block[first + 1]))
        before = float(block[-1])
    return None


def _describe(sample: int, before: float, now: float) -> str:
    if not np.isfinite(now):
        return f"time is {now} at sample {sample}"
    how = "repeats" if now == before else "goes backwards"
    return f"time {how} at sample {sample}: {now:.9g} after {before:.9g}"


def holds_number(values: Array) -> bool:
    """Whether any sample, shape (n_samples,), is a finite number."""
    return any(bool(np.isfinite(values[k : k + _BLOCK]).any()) for k in range(0, len(values), _BLOCK))


def value_problem(role: Role, values: Array) -> tuple[str, str] | None:
    """What is wrong with the values of a signal of this role, as (found, remedy); None when they are fine.

    An `extra` may be empty throughout (a broken sensor nobody needs); an input or output may not.
    """
    if role == "time":
        fault = time_fault(values)
        return None if fault is None else (fault[1], TIME_REMEDY)
    if role in {"input", "output"} and not holds_number(values):
        remedy = f"an {role} holds at least one number; give it the role 'extra' or leave it out"
        return ALL_MISSING, remedy
    return None


def codes_problem(codes: Array) -> tuple[str, str] | None:
    """What is wrong with codes of quality, shape (n_samples,), as (found, remedy); None when they are fine."""
    known = ((codes >= 0) & (codes < len(QUALITIES)) & (codes == np.floor(codes))) | (codes == NOT_KNOWN)
    known |= np.isnan(codes)
    if known.all():
        return None
    first = int(np.argmin(known))
    words = ", ".join(f"{code} {word}" for code, word in enumerate(QUALITIES))
    return f"the code {codes[first]:g} of sample {first} is no quality", f"allowed: {words}, {NOT_KNOWN} not known"


def size_problem(values: Array) -> tuple[str, str] | None:
    """Why values, shape (n_samples,), cannot be computed with, as (found, remedy); None when they can."""
    for start in range(0, len(values), _BLOCK):
        with np.errstate(invalid="ignore"):
            wild = np.abs(values[start : start + _BLOCK]) > LARGEST
        if wild.any():
            first = start + int(np.argmax(wild))
            return f"sample {first} is {values[first]:g}", "a sample is a finite number, or NaN where it is missing"
    return None


def clock_problem(time: Array) -> tuple[str, str] | None:
    """Why a clock [s], shape (n_samples,), that goes forward cannot be that of a measurement; None when it can."""
    remedy = "time is in s: import it with the unit that it has"
    if max(abs(time[0]), abs(time[-1])) > LATEST_S:
        return f"it runs from {time[0]:g} to {time[-1]:g} s", remedy
    shortest = min(float(np.diff(time[k : k + _BLOCK + 1]).min()) for k in range(0, len(time) - 1, _BLOCK))
    return (f"two samples are {shortest:g} s apart", remedy) if shortest < SHORTEST_STEP_S else None
