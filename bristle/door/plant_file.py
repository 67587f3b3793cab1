"""A file that describes a simulated valve, for `bristle serve --plant` and for tests: TOML with the words of `serve`.

::

    friction = "lugre"
    noise = true

    [set]
    setpoint = 0.3
    "lugre.fs" = 250

    [effect.backlash]
    width = 1e-4

    [[fault]]
    number = 4
    strength = 0.5
    from = 70
"""

from __future__ import annotations

import math
import os
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bristle.door.plants import actuator
from hil import ActuatorPlant
from recordings import BadInput
from simulator.damadics import Fault

LARGEST_FILE = 1_000_000
"""Bytes; a plant file has less than a hundred lines."""

Finite = Annotated[float, Field(allow_inf_nan=False)]


class PlannedFault(BaseModel):
    """A fault in a plant file; times are plant time [s]."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    number: int
    strength: Finite = 1.0
    start: Finite = Field(0.0, alias="from")
    develop: Finite = 0.0
    until: Finite | None = None
    direction: Literal[-1, 1] | None = None

    def fault(self) -> Fault:
        """The fault itself. Raises BadInput."""
        stop = math.inf if self.until is None else self.until
        return Fault(self.number, self.strength, self.start, self.develop, stop, self.direction)


class SimulatedPlantFile(BaseModel):
    """What a simulated valve is; everything has a default. Keys are the options of `bristle serve`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    map: str = "damadics"
    write_map: str = "damadics-write"
    scenario: str | None = None
    friction: str = "play"
    set: dict[str, Finite] = {}
    effect: dict[str, dict[str, Finite]] = {}
    effect_off: bool = False
    fault: tuple[PlannedFault, ...] = ()
    noise: bool = False
    seed: Annotated[int, Field(ge=0)] = 0

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SimulatedPlantFile:
        """The content of a file. Raises BadInput naming the file, the place in it, and what to do."""
        return cls._of(_content(Path(path)), str(path))

    def plant(self, number: int = 0) -> ActuatorPlant:
        """The simulated valve; `number` tells several apart by their noise. Raises BadInput."""
        return actuator(
            self.scenario, self.friction, [one.fault() for one in self.fault], self.set, self.effect,
            effects_on=not self.effect_off, noise=self.noise, seed=self.seed + number,
        )  # fmt: skip

    @classmethod
    def _of(cls, values: dict[str, Any], where: str) -> SimulatedPlantFile:
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"])
            if first["type"] == "extra_forbidden":
                known = PlannedFault if first["loc"][0] == "fault" else cls
                keys = ", ".join(field.alias or name for name, field in known.model_fields.items())
                raise BadInput(f"{where}: {place}", "this key is not known", f"known there: {keys}") from None
            given = f" (found {first['input']!r:.60})" if first["type"] != "missing" else ""
            raise BadInput(f"{where}: {place}", f"{first['msg']}{given}", "correct it, or leave it out") from None


def _content(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise BadInput(str(path), "it is larger than 1 MB", "give a plant file (.toml)")
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise BadInput(str(path), "there is no such file", "check the path") from None
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(str(path), f"it cannot be read ({error})", "give a TOML file in UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise BadInput(str(path), f"it is not TOML ({error})", "correct the line") from None
