"""Whether the sizes of an import can be those of a valve: a wrong unit is worth a sentence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from recordings.plant import Plant
from recordings.recording import Recording
from recordings.units import convert, find_unit

USUAL: Mapping[str, tuple[float, float, str]] = {
    "position": (1e-4, 1.0, "m"),
    "pressure": (1e3, 1.5e6, "Pa"),
    "supply_pressure": (1e4, 1.5e6, "Pa"),
    "force": (0.1, 2e6, "N"),
    "velocity": (0.0, 5.0, "m/s"),
    "upstream_pressure": (0.0, 1e8, "Pa"),
    "downstream_pressure": (0.0, 1e8, "Pa"),
    "temperature": (0.0, 1e3, "degC"),
    "setpoint": (0.0, 1.5, "1"),
    "drive": (0.0, 1.5, "1"),
}
"""By signal: the least and the most that its largest value may be, and their unit."""

USUAL_PLANT: Mapping[str, tuple[float, float, str]] = {
    "stroke_m": (1e-3, 1.0, "m"),
    "diaphragm_area_m2": (1e-4, 2.0, "m2"),
    "moving_mass_kg": (1e-2, 2e3, "kg"),
    "spring_constant_N_per_m": (1e2, 1e8, "N/m"),
}


def implausible(recording: Recording) -> tuple[str, ...]:
    """Sentences on what is hardly of a valve."""
    return (*_signals(recording), *_plant(recording.plant))


def _signals(recording: Recording) -> Iterator[str]:
    for name, (least, most, unit) in USUAL.items():
        signal = recording.signals.get(name)
        if signal is None:
            continue
        found = find_unit(signal.unit)
        if found is None:
            continue
        if name == "position" and found.si == "1":
            least, most, unit = USUAL["setpoint"]
        values = convert(signal.values, signal.unit, unit)
        there = values[np.isfinite(values)]
        if not len(there):
            continue
        largest = float(np.max(np.abs(there)))
        if not least <= largest <= most and largest > 0.0:
            yield f"{name} reaches {_sized(largest, unit)}, which is hardly of a valve: check the unit of its column"


def _plant(plant: Plant) -> Iterator[str]:
    for name, (least, most, unit) in USUAL_PLANT.items():
        value = getattr(plant, name)
        if value is not None and not least <= value <= most:
            yield f"{name} is {_sized(value, unit)}, which is hardly of a valve: the unit is the end of the name"


def _sized(value: float, unit: str) -> str:
    """A size in a unit that people read: the largest one in which it is 1 or more.

    >>> _sized(9e6, "Pa"), _sized(38.1, "m"), _sized(50.0, "1")
    ('9 MPa', '38.1 m', '5000 %')
    """
    choice = {"Pa": ("MPa", "kPa", "Pa"), "m": ("m", "mm", "um"), "1": ("%",)}.get(unit, (unit,))
    sizes = [(convert(value, unit, symbol), symbol) for symbol in choice]
    size, symbol = next((one for one in sizes if one[0] >= 1.0), sizes[-1])
    return f"{size:.4g} {symbol}"
