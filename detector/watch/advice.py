"""What an alarm of each kind means for who looks after the valve, and what to look at on site."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class KindAdvice:
    """reason : what has changed; check : what to look at on site, the likeliest first; valve : whether it is the valve
    or its transmitter that wants work, and not what surrounds it.
    """

    reason: str
    check: tuple[str, ...]
    valve: bool


ADVICE: Mapping[str | None, KindAdvice] = {
    "friction": KindAdvice(
        "the friction has changed",
        ("packing: tightness, lubrication, dirt", "stem and guides for scoring or bending",
         "compare with a signature test: bristle test --kind signature"),
        True,
    ),
    "spring": KindAdvice(
        "the spring, or the area of the diaphragm, has changed",
        ("actuator for air that leaks at diaphragm or seals", "spring for a broken coil",
         "bench set, by a signature test"),
        True,
    ),
    "sensor": KindAdvice(
        "the position cannot be believed: position and flow do not fit each other",
        ("feedback lever and its coupling to the stem", "zero and span of the position transmitter",
         "stem position by eye"),
        True,
    ),
    "supply": KindAdvice(
        "the supply pressure is not usual",
        ("air supply and its filter regulator", "other consumers on the same line"),
        False,
    ),
    "flow": KindAdvice(
        "flow or process pressures are not what belongs to the opening",
        ("process conditions against those learned in", "plug and seat for erosion or something stuck",
         "flow transmitter"),
        False,
    ),
    None: KindAdvice(
        "the valve moves unlike it was learned, for a reason that has no name",
        ("positioner and its air lines", "work that was done on the valve lately",
         "record it and trace: bristle trace"),
        False,
    ),
}  # fmt: skip
"""By kind of alarm; None is an unknown one."""
