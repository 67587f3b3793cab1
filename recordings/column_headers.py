"""What the header of a column says: a name, and often a unit beside it."""

from __future__ import annotations

import re
from collections.abc import Sequence

from recordings.signal import UNDERSTOOD
from recordings.units import find_unit

_BRACKETED = re.compile(r"^(.*?)\s*[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")


def split_unit(header: str) -> tuple[str, str | None]:
    """The name and the unit in a column's header.

    >>> split_unit("Stem position [mm]"), split_unit("force (N)"), split_unit("time_ms"), split_unit("valve_h")
    (('Stem position', 'mm'), ('force', 'N'), ('time', 'ms'), ('valve_h', None))
    """
    header = header.strip()
    match = _BRACKETED.match(header)
    if match and match[1]:
        known = find_unit(match[2])
        return match[1], known.symbol if known else match[2]
    name, _, symbol = header.rpartition("_")
    known = find_unit(symbol)
    if known and name.casefold() in UNDERSTOOD:
        return name, known.symbol
    return header, None


def named_columns(headers: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """The names of columns with these headers, made unique by their number, and the units the headers give."""
    names: list[str] = []
    units: dict[str, str] = {}
    for number, header in enumerate(headers, start=1):
        name, symbol = split_unit(header)
        name = name or str(number)
        names.append(f"{name} ({number})" if name in names else name)
        if symbol:
            units[names[-1]] = symbol
    return names, units
