"""A served actuator from the words of a command line, each refused with the option and the place in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from bristle.door.plant_file import SimulatedPlantFile
from bristle.door.plants import actuator
from hil import ActuatorPlant
from recordings import BadInput
from simulator.damadics import FAULTS, Fault

_FAULT_WORDS = {
    "strength": "strength",
    "from": "start_s",
    "develop": "development_s",
    "until": "stop_s",
    "direction": "direction",
}


@dataclass(frozen=True)
class ActuatorOptions:
    """The words: scenario name; friction form; faults ``4:strength=0.5,from=70``; settings ``lugre.fc=200``,
    ``gain=40``, ``setpoint=0.3``; effects ``backlash:width=1e-4``; whether those act from the start; noise and seed.

    base : what is so where the words say nothing; a plant file's content, or the defaults.
    """

    scenario: str | None = None
    friction: str | None = None
    faults: Sequence[str] = ()
    settings: Sequence[str] = ()
    effects: Sequence[str] = ()
    effects_on: bool = True
    noise: bool = False
    seed: int | None = None
    base: SimulatedPlantFile = field(default_factory=SimulatedPlantFile)

    def plant(self, number: int = 0) -> ActuatorPlant:
        """The plant; `number` tells several apart by their noise. Raises BadInput naming the option.

        >>> ActuatorOptions(faults=("4:strength=0.5,from=70",)).plant().signals()["fault_active"]
        0.0
        """
        base = self.base
        return actuator(
            self.scenario or base.scenario,
            self.friction or base.friction,
            [*(one.fault() for one in base.fault), *(_fault(text) for text in self.faults)],
            {**base.set, **_numbers("--set", self.settings)},
            {**base.effect, **dict(_effect(text) for text in self.effects)},
            effects_on=self.effects_on and not base.effect_off,
            noise=self.noise or base.noise,
            seed=(base.seed if self.seed is None else self.seed) + number,
        )


def _fault(text: str) -> Fault:
    """``4`` or ``4:strength=0.5,from=70,develop=20,until=100,direction=-1``."""
    number, _, rest = text.removeprefix("f").partition(":")
    if not number.isdecimal():
        raise BadInput("--fault", f"{text!r} does not begin with the number of a fault", f"1 to {len(FAULTS)}")
    words = _numbers("--fault", [part for part in rest.split(",") if part])
    for word in words:
        if word not in _FAULT_WORDS:
            raise BadInput("--fault", f"{text!r} has the unknown word {word!r}", f"use {', '.join(_FAULT_WORDS)}")
    direction = words.pop("direction", None)
    if direction not in {None, 1.0, -1.0}:
        raise BadInput("--fault", f"{text!r} has direction {direction:g}", "a direction is 1 or -1")
    keys = {_FAULT_WORDS[word]: value for word, value in words.items()}
    sign = None if direction is None else int(direction)
    return Fault(
        int(number),
        keys.get("strength", 1.0),
        keys.get("start_s", 0.0),
        keys.get("development_s", 0.0),
        keys.get("stop_s", math.inf),
        sign,
    )


def _effect(text: str) -> tuple[str, Mapping[str, float]]:
    """``backlash`` in its typical size, or ``backlash:width=1e-4``."""
    name, _, rest = text.partition(":")
    return name, _numbers("--effect", [part for part in rest.split(",") if part])


def _numbers(option: str, items: Sequence[str]) -> dict[str, float]:
    numbers = {}
    for item in items:
        name, _, text = item.partition("=")
        try:
            numbers[name.strip()] = float(text)
        except ValueError:
            raise BadInput(option, f"{item!r} is not name=number", "write for example lugre.fc=200") from None
        if math.isnan(numbers[name.strip()]):
            raise BadInput(option, f"{item!r} is not a number", "write for example lugre.fc=200")
    return numbers
