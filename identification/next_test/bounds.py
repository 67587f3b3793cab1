"""What a test may ask of a valve: travel, rate, pressure, duration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from recordings import BadParameter

DrivenBy = Literal["force", "pressure", "setpoint"]
"""What the sequence is a sequence of."""
DRIVES: tuple[DrivenBy, ...] = get_args(DrivenBy)


@dataclass(frozen=True)
class DesignBounds:
    """The limits of a test.

    travel : lowest and highest position, % of the stroke; rate : fastest change, % of the stroke in a second;
    pressure : lowest and highest [kPa], None where it is not limited; duration [s].
    Raises BadParameter for limits that leave nothing.
    """

    travel: tuple[float, float] = (10.0, 90.0)
    rate: float = 50.0
    pressure: tuple[float, float] | None = None
    duration: float = 60.0

    def __post_init__(self) -> None:
        low, high = self.travel
        if not 0 <= low < high <= 100:
            raise BadParameter("travel", f"{low:g}:{high:g}", "it is no part of the stroke", "give % of it: 10:90")
        for name in ("rate", "duration"):
            value = getattr(self, name)
            if not 0 < value < float("inf"):
                raise BadParameter(name, f"{value:g}", "it is not a positive number", "give a positive number")
        if self.pressure is not None and not 0 <= self.pressure[0] < self.pressure[1] < float("inf"):
            found = f"{self.pressure[0]:g}:{self.pressure[1]:g}"
            raise BadParameter("pressure", found, "it is no range", "give kPa, the lower end first: 40:180")


def bounds_of(text: str | None, **given: str | float | None) -> DesignBounds:
    """The limits of a text such as ``travel=10:90,rate=20,pressure=40:180,duration=60`` and of single ones by name.

    Single ones go before the text. Raises BadParameter for what is no limit.

    >>> bounds_of("rate=20,duration=30", travel="20:80")
    DesignBounds(travel=(20.0, 80.0), rate=20.0, pressure=None, duration=30.0)
    """
    found: dict[str, str | float] = {}
    for item in (text or "").split(",") if text else ():
        name, equals, value = item.strip().partition("=")
        if not equals or name not in ("travel", "rate", "pressure", "duration"):
            remedy = "write travel=10:90,rate=20,pressure=40:180,duration=60, or some of it"
            raise BadParameter("limits", item, "it is no limit", remedy)
        found[name] = value
    found |= {name: value for name, value in given.items() if value is not None}
    return DesignBounds(
        travel=_pair("travel", found.get("travel", "10:90")), rate=_number("rate", found.get("rate", 50.0)),
        pressure=_pair("pressure", found["pressure"]) if "pressure" in found else None,
        duration=_number("duration", found.get("duration", 60.0)),
    )  # fmt: skip


def _pair(name: str, value: str | float) -> tuple[float, float]:
    low, colon, high = str(value).partition(":")
    if not colon:
        raise BadParameter(name, value, "it is not LOW:HIGH", "write for example 10:90")
    return _number(name, low), _number(name, high)


def _number(name: str, value: str | float) -> float:
    try:
        return float(value)
    except ValueError:
        raise BadParameter(name, value, "it is no number", "write for example 20") from None
