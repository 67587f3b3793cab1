"""What is known of a plant besides its signals, and what happened to it during a recording."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from recordings.errors import BadInput, BadParameter
from recordings.signal import text_problem


@dataclass(frozen=True)
class Plant:
    """What is known of the plant; every item is optional and the unit is the end of its name.

    Raises `BadInput` for a value that cannot be: mass, stroke and area are positive, a spring constant is not negative.

    >>> Plant(moving_mass_kg=2.0, tag="LC74_20").known()
    {'moving_mass_kg': 2.0, 'tag': 'LC74_20'}
    """

    moving_mass_kg: float | None = None
    stroke_m: float | None = None
    diaphragm_area_m2: float | None = None
    spring_constant_N_per_m: float | None = None
    spring_preload_N: float | None = None
    tag: str | None = None

    def __post_init__(self) -> None:
        for name, value in self.known().items():
            problem = plant_problem(name, value)
            if problem:
                raise BadInput(f"/plant: {name}", *problem)

    @classmethod
    def of(cls, known: Plant | Mapping[str, float | str] | None) -> Plant:
        """The plant of what is known of one: items by name, a plant as it is, or nothing.

        Raises `BadParameter` for an item that no plant has, `BadInput` for a value that cannot be.
        """
        if isinstance(known, Plant):
            return known
        items: dict[str, Any] = dict(known or {})
        for name in items:
            if name not in PLANT_NAMES:
                raise BadParameter("plant", name, "it is not known of a plant", f"allowed: {', '.join(PLANT_NAMES)}")
        return cls(**items)

    def known(self) -> dict[str, float | str]:
        """The items that are given, by name."""
        items = ((item.name, getattr(self, item.name)) for item in fields(self))
        return {name: value for name, value in items if value is not None}


PLANT_NAMES: tuple[str, ...] = tuple(item.name for item in fields(Plant))


def plant_problem(name: str, value: Any) -> tuple[str, str] | None:
    """What is wrong with one item of the plant, as (found, remedy); None when it is fine."""
    if name == "tag":
        wrong = text_problem(value)
        return (wrong, "the tag is the plant's own name for the valve") if wrong else None
    if not is_number(value):
        return f"{value!r} is not a number", f"{name} is one number, the unit is the end of its name"
    lowest = {"spring_preload_N": -math.inf, "spring_constant_N_per_m": 0.0}.get(name, math.ulp(0.0))
    if not (math.isfinite(value) and value >= lowest):
        allowed = "finite" if lowest < 0 else "finite and not negative" if lowest == 0 else "finite and positive"
        return f"the value is {value:g}", f"{name} is {allowed}; leave it out when it is not known"
    return None


@dataclass(frozen=True)
class Event:
    """Something that happened during a recording.

    time : s, on the recording's clock; kind : a short name such as ``note``, ``fault`` or ``gap``; text : one line.
    """

    time: float
    kind: str
    text: str

    def __post_init__(self) -> None:
        wrong = None if is_number(self.time) and math.isfinite(self.time) else f"the time is {self.time!r}"
        wrong = wrong or text_problem(self.kind) or text_problem(self.text)
        if wrong:
            raise BadInput("/events", wrong, "an event has a finite time in s, a kind and a text")


def is_number(value: Any) -> bool:
    """Whether a value is a real number, and not a truth value."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)
