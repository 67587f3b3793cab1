"""A plant that remembers: every sample since its last reset, what was ordered of it, and what is ordered for later."""

from __future__ import annotations

import math
from bisect import insort
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from hil.plant.plant import Command, ServedPlant
from recordings import Array, Event, Plant, Recording

KEPT_S = 3600.0
"""Plant time that is remembered [s]; what is older is forgotten."""

QUIET = frozenset({"setpoint"})
"""Commands that are no event: they come with every step of a controller, and the recording has them as a signal."""


class RecordedPlant:
    """Wraps a plant and is one, `ServedPlant`. A reset begins the recording anew, so that its clock is plant time.

    Parameters
    ----------
    plant : ServedPlant
        What is recorded.
    about : Plant
        What the recording says of it.
    kept_s : float, optional
        How much plant time is remembered [s].
    """

    def __init__(self, plant: ServedPlant, about: Plant, kept_s: float = KEPT_S) -> None:
        self._plant, self._about = plant, about
        self._most = max(2, round(kept_s / plant.step_s))
        self._due: list[tuple[float, int, Mapping[str, float]]] = []
        self._ordered = 0
        self._begin()

    @property
    def step_s(self) -> float:
        """Time between two samples [s]."""
        return self._plant.step_s

    @property
    def units(self) -> Mapping[str, str]:
        """The signals and their units."""
        return self._plant.units

    @property
    def commands(self) -> Mapping[str, Command]:
        """The commands and their units."""
        return self._plant.commands

    @property
    def time_s(self) -> float:
        """Plant time [s]."""
        return self._plant.signals()["plant_time"]

    @property
    def events(self) -> tuple[Event, ...]:
        """What was ordered and noted since the last reset."""
        return tuple(self._events)

    def signals(self) -> Mapping[str, float]:
        """All signals now."""
        return self._plant.signals()

    def settings(self) -> Mapping[str, float]:
        """What every command is set to now."""
        return self._plant.settings()

    def apply(self, changes: Mapping[str, float]) -> None:
        """Carry out commands, all or none. Raises BadInput for a value that cannot be."""
        before = self.time_s
        self._plant.apply(changes)
        if self.time_s < before:  # changing the form of friction starts the plant anew
            self._begin()
        told = {name: value for name, value in changes.items() if name not in QUIET}
        if told:
            self.note("order", ", ".join(f"{name} = {value:g}" for name, value in told.items()))

    def order(self, changes: Mapping[str, float], at_s: float) -> None:
        """Carry out commands with the first sample at `at_s` of plant time or later [s]; at once when that is over."""
        if at_s <= self.time_s:
            self.apply(changes)
        else:
            self._ordered += 1
            insort(self._due, (at_s, self._ordered, dict(changes)))

    def reset(self) -> None:
        """Back to the initial state; the settings stay."""
        self._plant.reset()
        self._begin()

    def advance(self, n_steps: int) -> Mapping[str, Array]:
        """Move on by n_steps and return every signal at each of the new samples, shape (n_steps,)."""
        parts: list[Mapping[str, Array]] = []
        while n_steps:
            n = min(n_steps, self._steps_to_order())
            if n:
                parts.append(self._plant.advance(n))
                n_steps -= n
            else:
                self.apply(self._due.pop(0)[2])
        samples = parts[0] if len(parts) == 1 else {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
        self._remember(samples)
        return samples

    def note(self, kind: str, text: str) -> None:
        """Remember that something happened now."""
        self._events.append(Event(self.time_s, kind, text))

    def recording(self, title: str, events: Sequence[Event]) -> Recording:
        """Every sample that is remembered, with given events. Raises BadInput when there are less than two."""
        columns = {name: np.concatenate([block[name] for block in self._blocks]) for name in self.units}
        time = columns.pop("plant_time")
        units = {name: unit for name, unit in self.units.items() if name in columns}
        made = Recording.from_arrays(time=time, extra=columns, units=units, plant=self._about, source="simulated")
        return Recording.of(
            made.signals.values(), plant=self._about, title=title, source="simulated", events=tuple(events)
        )

    def _begin(self) -> None:
        self._blocks: deque[Mapping[str, Array]] = deque()
        self._events: list[Event] = []
        self._kept = 0
        self._remember({name: np.array([value]) for name, value in self._plant.signals().items()})

    def _remember(self, samples: Mapping[str, Array]) -> None:
        self._blocks.append(samples)
        self._kept += len(samples["plant_time"])
        while self._kept - len(self._blocks[0]["plant_time"]) >= self._most:
            self._kept -= len(self._blocks.popleft()["plant_time"])

    def _steps_to_order(self) -> int:
        """Samples before the next order is due; the millionth of a step is for rounding."""
        if not self._due:
            return 1 << 30
        return max(0, math.ceil((self._due[0][0] - self.time_s) / self.step_s - 1e-6) - 1)
