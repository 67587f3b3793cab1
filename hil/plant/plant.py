"""What the server needs of a plant, whatever it is: signals that move on in equal steps, and settings to change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from recordings import Array


@dataclass(frozen=True)
class Command:
    """Something that can be told to a plant: its unit, and whether it damages the plant (faults, hidden effects)."""

    unit: str = "1"
    harmful: bool = False


class ServedPlant(Protocol):
    """A plant in equal steps of `step_s` seconds. It holds no clock: whoever drives it decides how fast time goes.

    units : unit of every signal, by name; commands : what `apply` understands, by name. `advance` and `signals` give
    values in `units`, `apply` takes values in the units of `commands`. Among the signals is ``plant_time`` [s] since
    the start or the last reset; a signal ``fault_active`` (0 or 1), if there is one, shows in the status word.
    """

    @property
    def step_s(self) -> float:
        """Time between two samples [s]."""
        ...

    @property
    def units(self) -> Mapping[str, str]:
        """The signals and their units."""
        ...

    @property
    def commands(self) -> Mapping[str, Command]:
        """The commands and their units."""
        ...

    def signals(self) -> Mapping[str, float]:
        """All signals now."""
        ...

    def advance(self, n_steps: int) -> Mapping[str, Array]:
        """Move on by n_steps and return every signal at each of the new samples, shape (n_steps,)."""
        ...

    def settings(self) -> Mapping[str, float]:
        """What every command is set to now."""
        ...

    def apply(self, changes: Mapping[str, float]) -> None:
        """Change some settings, all of them or none. Raises BadInput when a value is impossible."""
        ...

    def reset(self) -> None:
        """Back to the initial state; the settings stay."""
        ...
