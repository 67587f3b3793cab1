"""Numbers, times and states as the page writes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import UTC, datetime

from hil.service.status import Health

NARROW = "\N{NARROW NO-BREAK SPACE}"
NOTHING = "–"

SHOWN: Mapping[str, tuple[str, float, str]] = {
    "position": ("position", 1e3, "mm"), "setpoint": ("set point", 100.0, "%"),
    "pressure": ("actuator pressure", 1e-3, "kPa"), "force": ("force", 1.0, "N"),
    "supply_pressure": ("supply pressure", 1e-3, "kPa"), "upstream_pressure": ("upstream pressure", 1e-3, "kPa"),
    "downstream_pressure": ("downstream pressure", 1e-3, "kPa"),
    "flow": ("flow", 3600.0, "m³/h"), "mass_flow": ("mass flow", 1.0, "kg/s"),
}  # fmt: skip
"""How a signal in SI units is named and shown: words, factor, unit."""


def number(value: float, digits: int = 3) -> str:
    """A value with so many significant digits; a dash for none.

    >>> number(1234.5), number(0.012345), number(float("nan"))
    ('1230', '0.0123', '–')
    """
    if not math.isfinite(value):
        return NOTHING
    if value == 0.0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):.{max(0, places)}f}".replace("-", "−")


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A value and its unit, which stay on one line; a dash alone for none."""
    text = number(value, digits)
    return text if text == NOTHING else f"{text}{NARROW}{unit}"


def measured(name: str, value: float) -> tuple[str, str]:
    """The words for a signal of `SHOWN` in SI units, and its value.

    >>> words, value = measured("position", 0.0123456)
    >>> words, value.replace(NARROW, " ")
    ('position', '12.35 mm')
    """
    words, factor, unit = SHOWN[name]
    value *= factor
    if not math.isfinite(value):
        return words, NOTHING
    text = f"{value:.2f}".replace("-", "−") if unit in ("mm", "%") else number(value)
    return words, f"{text}{NARROW}{unit}"


def lasting(seconds: float) -> str:
    """A stretch of time, as short as it can be said.

    >>> [lasting(t).replace(NARROW, " ") for t in (3.2, 75.0, 7300.0, 200_000.0)]
    ['3 s', '1 min', '2 h', '2 d']
    """
    if not math.isfinite(seconds):
        return "ever"
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= size:
            return f"{seconds / size:.0f}{NARROW}{unit}"
    return f"{max(seconds, 0.0):.0f}{NARROW}s"


def clock(moment: datetime | float, day: bool = False) -> str:
    """A time of day in UTC, or with its day. moment : a time with a zone, or POSIX time [s].

    >>> clock(0.0), clock(0.0, day=True)
    ('00:00:00', '1970-01-01 00:00:00')
    """
    when = datetime.fromtimestamp(moment, UTC) if isinstance(moment, float) else moment.astimezone(UTC)
    return f"{when:%Y-%m-%d %H:%M:%S}" if day else f"{when:%H:%M:%S}"


def since(moment: datetime, now: datetime) -> str:
    """Since when something is so: the time, with its day where that is another, and how long that is."""
    other_day = moment.astimezone(UTC).date() != now.astimezone(UTC).date()
    return f"since {clock(moment, other_day)} UTC ({lasting((now - moment).total_seconds())})"


OUTLINES: Mapping[Health, str] = {
    Health.GOOD: '<circle cx="12" cy="12" r="10"/>',
    Health.MAINTENANCE: '<path d="M12 1 23 12 12 23 1 12Z"/>',
    Health.OUT_OF_SPEC: '<path d="M12 2 23 22H1Z"/>',
    Health.CHECK: '<path d="M12 22 23 2H1Z"/>',
    Health.FAILURE: '<circle cx="12" cy="12" r="10"/><path class="cross" d="M6 6 18 18M18 6 6 18"/>',
}
"""The shape of a state, drawn in a square of 24; it goes with `Health.shape`."""
