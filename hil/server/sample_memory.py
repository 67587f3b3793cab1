"""The server's side of a ring: remembers the last samples and lays the asked-for slots out as registers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hil.registers.codec import saturated
from hil.registers.ring import COUNTER
from hil.server.layout import ServedPoint
from recordings import Array

_NEVER = 0xFFFFFFFF


class SampleMemory:
    """The last `slots` samples of some places, in the plant's units; slots never written carry no valid number."""

    def __init__(self, places: Sequence[ServedPoint], slots: int) -> None:
        self.slots = slots
        self._places = tuple(places)
        self._values = np.zeros((slots, len(self._places)))
        self._numbers = np.full(slots, _NEVER, np.int64)
        self._slot_size = COUNTER + sum(place.point.count for place in self._places)

    def remember(self, first: int, samples: Mapping[str, Array]) -> None:
        """Keep samples from number `first` on, arrays of shape (n_samples,) by name; only the last `slots` fit."""
        n = len(next(iter(samples.values())))
        numbers = np.arange(first, first + n)[-self.slots :]
        rows = numbers % self.slots
        self._numbers[rows] = numbers & _NEVER
        for column, place in enumerate(self._places):
            self._values[rows, column] = samples[place.point.name][-self.slots :]

    def words(self, start: int, count: int) -> list[int]:
        """`count` registers from register `start` of the ring on; slots need not be read whole."""
        first, last = start // self._slot_size, (start + count - 1) // self._slot_size
        registers = [word for slot in range(first, last + 1) for word in self._slot(slot)]
        return registers[start - first * self._slot_size :][:count]

    def _slot(self, slot: int) -> list[int]:
        number = int(self._numbers[slot])
        words = [number >> 16, number & 0xFFFF]
        for place, value in zip(self._places, self._values[slot], strict=True):
            words += saturated(place.point, place.from_plant(float(value)))
        return words
