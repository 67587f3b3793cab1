"""Judging samples against those before: a heartbeat that stands still, and events for values that are not good."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping

from hil.source.episode import QUIET_S, Episode
from hil.source.sample import LinkEvent, Quality, Reading, Sample

GOOD_AGAIN_AFTER_S = 1.0
"""A value that comes and goes makes one event, not one a sample: it is good again after so long without a fault, and
after twice as long each time that it was not good for long, up to `QUIET_S`."""


class Heartbeat:
    """A point that must change while the device is alive, though its link and its registers may work on without it.

    name : of the point; limit : s after which the same value means that everything from the device is stale.
    """

    def __init__(self, name: str, limit: float) -> None:
        self.name, self.limit = name, limit
        self._value, self._changed_at = math.nan, math.nan

    def check(self, time: float, readings: Mapping[str, Reading]) -> Mapping[str, Reading]:
        """The readings of one moment [s], good ones made stale when the heartbeat has stood still for too long."""
        beat = readings[self.name]
        if math.isnan(self._changed_at) or (beat.good and beat.value != self._value):
            self._value, self._changed_at = beat.value, time
        still = time - self._changed_at
        if still <= self.limit:
            return readings
        reason = f"the heartbeat '{self.name}' has not changed for {still:.1f} s"
        return {name: _stale(reading, reason) for name, reading in readings.items()}


def _stale(reading: Reading, reason: str) -> Reading:
    return reading._replace(quality=Quality.STALE, reason=reason) if reading.good else reading


class Episodes:
    """Turns the readings of one valve that are not good into events: one when they begin, one when they are over."""

    def __init__(self) -> None:
        self._open: dict[str, Episode] = {}
        self._quiet_s, self._ended = dict[str, float](), dict[str, float]()

    def observe(self, sample: Sample) -> list[LinkEvent]:
        """The events that a sample causes."""
        if not self._open and sample.good:
            return []
        started: dict[str, list[str]] = defaultdict(list)
        for name, reading in sample.readings.items():
            if reading.good:
                continue
            if name in self._open:
                self._open[name].again(sample.time)
            else:
                again = sample.time - self._ended.get(name, -math.inf) < QUIET_S
                self._quiet_s[name] = min(2 * self._quiet_s[name], QUIET_S) if again else GOOD_AGAIN_AFTER_S
                self._open[name] = Episode.begin(sample.time)
                started[f"{reading.quality}: {reading.reason}"].append(name)
        texts = [f"{', '.join(names)}: {reason}" for reason, names in started.items()]
        return [
            LinkEvent(sample.time, sample.wall, sample.valve, "bad_value", text) for text in texts + self._over(sample)
        ]

    def _over(self, sample: Sample) -> list[str]:
        over: dict[int, list[str]] = defaultdict(list)
        for name, episode in list(self._open.items()):
            if episode.over(sample.time, self._quiet_s[name]):
                self._ended[name] = sample.time
                over[self._open.pop(name).n].append(name)
        return [f"{', '.join(names)}: good again, {n} samples were not" for n, names in over.items()]
