"""Units: what plants write beside a number, and what it is in SI.

A table, not a library: valves need a few dozen symbols. Two units can be converted into each other when they share
their SI unit, which therefore stands for the dimension.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from recordings.errors import BadInput

FloatOrArray = TypeVar("FloatOrArray", float, NDArray[np.float64])


@dataclass(frozen=True)
class Unit:
    """A unit: ``value in SI = value * scale + offset``.

    symbol : as written in files, UCUM style; si : the SI unit of its dimension; scale, offset : in `si`.

    >>> unit("degF").to_si(212.0)
    373.15
    """

    symbol: str
    si: str
    scale: float = 1.0
    offset: float = 0.0

    def to_si(self, values: FloatOrArray) -> FloatOrArray:
        """Convert values in this unit to SI."""
        return values * self.scale + self.offset

    def from_si(self, values: FloatOrArray) -> FloatOrArray:
        """Convert SI values to this unit."""
        return (values - self.offset) / self.scale


_INCH, _POUND_FORCE, _GALLON = 0.0254, 4.4482216152605, 3.785411784e-3
_SCALES: Mapping[str, Mapping[str, float]] = {
    "1": {"1": 1, "%": 0.01},
    "s": {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60, "h": 3600, "d": 86400},
    "Hz": {"Hz": 1, "kHz": 1e3},
    "m": {"m": 1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": _INCH, "ft": 12 * _INCH},
    "m2": {"m2": 1, "cm2": 1e-4, "mm2": 1e-6, "in2": _INCH**2},
    "m/s": {"m/s": 1, "cm/s": 1e-2, "mm/s": 1e-3, "um/s": 1e-6, "in/s": _INCH},
    "m/s2": {"m/s2": 1, "mm/s2": 1e-3},
    "rad": {"rad": 1, "mrad": 1e-3, "deg": np.pi / 180},
    "rad/s": {"rad/s": 1, "deg/s": np.pi / 180, "rpm": np.pi / 30},
    "kg": {"kg": 1, "g": 1e-3, "lb": 0.45359237, "t": 1e3},
    "N": {"N": 1, "kN": 1e3, "mN": 1e-3, "uN": 1e-6, "lbf": _POUND_FORCE, "kgf": 9.80665},
    "N.m": {"N.m": 1, "mN.m": 1e-3},
    "N/m": {"N/m": 1, "N/mm": 1e3, "kN/m": 1e3, "lbf/in": _POUND_FORCE / _INCH},
    "Pa": {
        "Pa": 1,
        "hPa": 1e2,
        "kPa": 1e3,
        "MPa": 1e6,
        "mbar": 1e2,
        "bar": 1e5,
        "psi": _POUND_FORCE / _INCH**2,
        "kgf/cm2": 98066.5,
        "atm": 101325.0,
        "mmH2O": 9.80665,
        "inH2O": 249.08891,
        "mmHg": 133.322387415,
    },
    "m3/s": {"m3/s": 1, "m3/h": 1 / 3600, "l/s": 1e-3, "l/min": 1e-3 / 60, "l/h": 1e-3 / 3600, "gpm": _GALLON / 60},
    "kg/s": {"kg/s": 1, "kg/h": 1 / 3600, "t/h": 1e3 / 3600, "lb/h": 0.45359237 / 3600},
    "V": {"V": 1, "mV": 1e-3},
    "A": {"A": 1, "mA": 1e-3},
}
_TEMPERATURES = (Unit("K", "K"), Unit("degC", "K", 1.0, 273.15), Unit("degF", "K", 5 / 9, 459.67 * 5 / 9))

UNITS: Mapping[str, Unit] = MappingProxyType(
    {symbol: Unit(symbol, si, scale) for si, scales in _SCALES.items() for symbol, scale in scales.items()}
    | {temperature.symbol: temperature for temperature in _TEMPERATURES}
)
"""Every unit the toolkit converts, by its symbol."""

# Gauge pressures keep their zero: what differs is a constant force, which the preload absorbs.
_SPELLINGS: Mapping[str, str] = {
    "percent": "%",
    "pct": "%",
    "sec": "s",
    "µs": "us",
    "μs": "us",
    "µm": "um",
    "μm": "um",
    "µN": "uN",
    "μN": "uN",
    "Nm": "N.m",
    "barg": "bar",
    "psig": "psi",
    "[psi]": "psi",
    "[lbf_av]": "lbf",
    "[in_i]": "in",
    "Cel": "degC",
    "°C": "degC",
    "[degF]": "degF",
    "°F": "degF",
    "°": "deg",
    "m³/h": "m3/h",
    "m^3/h": "m3/h",
    "m³/s": "m3/s",
    "m^3/s": "m3/s",
    "L/min": "l/min",
    "m/s^2": "m/s2",
    "m/s²": "m/s2",
    "m²": "m2",
    "m^2": "m2",
}


def find_unit(symbol: str) -> Unit | None:
    """The unit of a symbol, other common spellings included; None when the table does not know it.

    >>> find_unit("°F").symbol, find_unit("furlong")
    ('degF', None)
    """
    symbol = symbol.strip()
    return UNITS.get(_SPELLINGS.get(symbol, symbol))


def unit(symbol: str, where: str = "unit") -> Unit:
    """The unit of a symbol.

    Raises
    ------
    BadInput
        The table does not know the symbol; `where` says whose unit it is.
    """
    found = find_unit(symbol)
    if found is None:
        raise BadInput(where, f"the unit '{symbol}' is not known", f"known units: {', '.join(UNITS)}")
    return found


def siblings(si: str) -> str:
    """The symbols that convert to this SI unit, for messages.

    >>> siblings("rad/s")
    'rad/s, deg/s, rpm'
    """
    return ", ".join(symbol for symbol, one in UNITS.items() if one.si == si)


def convert(values: FloatOrArray, source: str, target: str, where: str = "unit") -> FloatOrArray:
    """Convert values from one unit to another.

    Raises
    ------
    BadInput
        A unit is not known, or the two measure different things.

    >>> round(convert(1.0, "psi", "kPa"), 6)
    6.894757
    """
    old, new = unit(source, where), unit(target, where)
    if old.si != new.si:
        raise BadInput(where, f"'{source}' cannot be converted to '{target}'", f"allowed units: {siblings(new.si)}")
    return values if old == new else new.from_si(old.to_si(values))
