"""How plant time follows the clock, and how late it is: a value that is told the time, so that a test can tell it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

_SHORTEST, _LONGEST, _PER_DECADE = 1e-6, 1e4, 40


class Lateness:
    """A distribution of delays [s] in constant memory: classes of 6 % width from 1 µs to 10 000 s, the largest exact.

    >>> late = Lateness()
    >>> for delay in (0.001, 0.001, 0.5):
    ...     late.add(delay)
    >>> late.maximum, 0.0009 < late.quantile(0.5) < 0.0011
    (0.5, True)
    """

    def __init__(self) -> None:
        self.maximum = 0.0
        self._counts = np.zeros(1 + round(_PER_DECADE * math.log10(_LONGEST / _SHORTEST)), int)

    def add(self, delay: float) -> None:
        """Count one delay; earliness is no lateness."""
        self.maximum = max(self.maximum, delay)
        place = 0 if delay <= _SHORTEST else round(_PER_DECADE * math.log10(delay / _SHORTEST))
        self._counts[min(place, len(self._counts) - 1)] += 1

    @property
    def count(self) -> int:
        """How many delays were counted."""
        return int(self._counts.sum())

    def quantile(self, share: float) -> float:
        """The delay that `share` of all stay within; 0 when there is none yet."""
        reached = np.cumsum(self._counts)
        if not reached[-1]:
            return 0.0
        place = int(np.searchsorted(reached, share * reached[-1]))
        return min(self.maximum, _SHORTEST * 10 ** (place / _PER_DECADE))


@dataclass(frozen=True)
class LatenessReport:
    """Lateness of samples against the clock so far [s]."""

    samples: int
    p50: float
    p99: float
    maximum: float


class Pace:
    """Plant time that runs `speed` times as fast as the clock.

    step_s : plant time of a sample [s]. `now` is always the reading of a monotonic clock [s]. Sample k is due
    ``k * step_s / speed`` after the first `release`; time on hold does not count.
    """

    def __init__(self, step_s: float, speed: float) -> None:
        self._interval = step_s / speed
        self._origin = 0.0
        self._done = 0
        self._held_at: float | None = 0.0
        self._lateness = Lateness()
        self.behind = 0.0

    def due(self, now: float) -> int:
        """How many samples should exist by now and do not."""
        if self._held_at is not None:
            return 0
        # The millionth keeps a sample that is due exactly now from slipping to the next look by rounding.
        return max(0, math.floor((now - self._origin) / self._interval + 1e-6) - self._done)

    def done(self, n_samples: int, now: float) -> None:
        """`n_samples` more exist now; the oldest of them is the latest."""
        self.behind = max(0.0, now - self._origin - (self._done + 1) * self._interval)
        self._lateness.add(self.behind)
        self._done += n_samples

    def hold(self, now: float) -> None:
        """Stop plant time."""
        self._held_at = now if self._held_at is None else self._held_at

    def release(self, now: float) -> None:
        """Start plant time, or let it go on from where it stopped."""
        if self._held_at is not None:
            self._origin += now - self._held_at
            self._held_at = None

    def report(self) -> LatenessReport:
        """Lateness so far."""
        late = self._lateness
        return LatenessReport(self._done, late.quantile(0.5), late.quantile(0.99), late.maximum)
