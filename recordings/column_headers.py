"""What the header of a column says: a name, and often a unit beside it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence

from recordings.signal import UNDERSTOOD
from recordings.units import find_unit, unit

_BRACKETED = re.compile(r"^(.*?)\s*[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")

_WORDS: Mapping[str, Sequence[str]] = {
    "time": (
        "t", "timestamp", "time stamp", "datetime", "date time", "date", "elapsed", "zeit", "zeitstempel", "datum",
        "uhrzeit",
    ),
    "position": (
        "pos", "travel", "valve travel", "stem travel", "stem position", "valve position", "actual position", "stem",
        "position feedback", "feedback", "stroke", "hub", "stellung", "ventilstellung", "stellweg", "zt", "zi",
    ),
    "setpoint": ("sp", "set point", "target", "target position", "position setpoint", "command", "sollwert"),
    "drive": ("drive signal", "positioner output", "output", "op", "controller output", "i/p", "stellsignal"),
    "pressure": (
        "actuator pressure", "chamber pressure", "diaphragm pressure", "bench pressure", "output pressure",
        "p actuator", "stelldruck", "kammerdruck",
    ),
    "supply_pressure": ("supply", "supply air", "air supply", "supply air pressure", "zuluft", "zuluftdruck"),
    "force": ("thrust", "stem force", "actuator force", "load cell", "load", "kraft", "stellkraft"),
    "velocity": ("speed", "stem velocity", "geschwindigkeit"),
    "flow": ("flow rate", "flowrate", "durchfluss"),
    "upstream_pressure": ("p1", "inlet pressure", "pressure in", "vordruck"),
    "downstream_pressure": ("p2", "outlet pressure", "pressure out", "hinterdruck"),
    "temperature": ("temp", "medium temperature", "temperatur"),
}  # fmt: skip
"""What plants and rigs call the signals that the toolkit understands."""

_MEANT = {word: name for name, words in _WORDS.items() for word in (*words, name.replace("_", " "))}


def known_name(header: str, symbol: str | None = None) -> str | None:
    """The understood name that a column's header means; None when it means none, or its unit measures something else.

    >>> known_name("Actuator pressure", "bar"), known_name("Travel", "%"), known_name("Zeitstempel"), known_name("note")
    ('pressure', 'position', 'time', None)
    """
    text = re.sub(r"[^a-z0-9/]+", " ", header.casefold()).strip()
    name = _MEANT.get(text)
    known = find_unit(symbol) if symbol else None
    if name is None or known is None:
        return name
    fits = {unit(UNDERSTOOD[name]).si} | ({"1"} if name in {"position", "setpoint", "drive"} else set())
    return name if known.si in fits else None


def meant(word: str, allowed: Iterable[str]) -> str:
    """A question that helps with a typo, empty where nothing is near.

    >>> meant("postion", UNDERSTOOD), meant("pos", UNDERSTOOD), meant("gland", UNDERSTOOD)
    ("did you mean 'position'?", "did you mean 'position'?", '')
    """
    names, known = list(allowed), known_name(word)
    return f"did you mean '{known}'?" if known in names and known != word else did_you_mean(word, names)


def did_you_mean(word: str, allowed: Iterable[str]) -> str:
    """The same by spelling alone.

    >>> did_you_mean("Stem positon", ["time", "Stem position"])
    "did you mean 'Stem position'?"
    """
    lower = {name.casefold(): name for name in allowed}
    close = difflib.get_close_matches(word.casefold(), list(lower), n=1, cutoff=0.7)
    return f"did you mean '{lower[close[0]]}'?" if close and lower[close[0]] != word else ""


def split_unit(header: str) -> tuple[str, str | None]:
    """The name and the unit in a column's header.

    >>> split_unit("Stem position [mm]"), split_unit("force (N)"), split_unit("pos_mm"), split_unit("valve_h")
    (('Stem position', 'mm'), ('force', 'N'), ('pos', 'mm'), ('valve_h', None))
    """
    header = header.strip()
    match = _BRACKETED.match(header)
    if match and match[1]:
        known = find_unit(match[2])
        return match[1], known.symbol if known else match[2]
    name, _, symbol = header.rpartition("_")
    known = find_unit(symbol)
    if known and (name.casefold() in UNDERSTOOD or known_name(name, symbol)):
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
