"""The newest samples and events of a valve, for whoever looks: written by one thread and copied by others."""

from __future__ import annotations

import threading
from collections import deque

import numpy as np

from hil.monitor.event import MonitorEvent
from hil.service.status import RecentSamples

KEPT = 6000
"""Samples that are kept of each valve: 10 min at 10 Hz, 1 min at 100 Hz; 0.3 MB."""

_COLUMNS = 6

EVENTS_KEPT = 25


class RecentRing:
    """The last samples. with_setpoint, with_force : whether there are such columns.

    >>> ring = RecentRing(False, False, kept=2)
    >>> for k in range(3):
    ...     ring.add(float(k), 0.01 * k, 0.0, 0.0, 0.0, 1.0)
    >>> ring.samples().time_s.tolist()
    [1.0, 2.0]
    """

    def __init__(self, with_setpoint: bool, with_force: bool, kept: int = KEPT) -> None:
        self._rows = np.full((kept, _COLUMNS), np.nan)
        self._n, self._with_setpoint, self._with_force = 0, with_setpoint, with_force
        self._lock = threading.Lock()

    def add(
        self, time_s: float, position_m: float, setpoint_m: float, force_N: float, residual: float, threshold: float
    ) -> None:
        """One sample; see `RecentSamples`."""
        with self._lock:
            self._rows[self._n % len(self._rows)] = (time_s, position_m, setpoint_m, force_N, residual, threshold)
            self._n += 1

    def samples(self) -> RecentSamples:
        """A copy of what there is."""
        with self._lock:
            kept = len(self._rows)
            rows = self._rows[: self._n].copy() if self._n < kept else np.roll(self._rows, -(self._n % kept), axis=0)
        time, position, setpoint, force, residual, threshold = rows.T
        return RecentSamples(
            time,
            position,
            setpoint if self._with_setpoint else None,
            force if self._with_force else None,
            residual,
            threshold,
        )


class NewestEvents:
    """The newest events of a valve, `kept` judgements of the detector and as many others: a bad link must not push an
    alarm out of sight. `all` has them in the order in which they came.
    """

    def __init__(self, kept: int = EVENTS_KEPT) -> None:
        self._judged, self._others = deque[MonitorEvent](maxlen=kept), deque[MonitorEvent](maxlen=kept)
        self.all: tuple[MonitorEvent, ...] = ()

    def add(self, event: MonitorEvent) -> None:
        """One more."""
        (self._judged if event.judged else self._others).append(event)
        self.all = tuple(sorted((*self._judged, *self._others), key=lambda one: one.t_s))
