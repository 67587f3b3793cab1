"""A signal: one measured quantity over a recording, with its unit and its role."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.units import find_unit, siblings, unit

Role = Literal["time", "input", "output", "extra"]
"""What a signal is to the plant: its clock, what drives it, what it answers with, or anything else."""

ROLES: tuple[Role, ...] = get_args(Role)

UNDERSTOOD: Mapping[str, str] = MappingProxyType(
    {
        "time": "s",
        "setpoint": "1",
        "drive": "1",
        "pressure": "Pa",
        "supply_pressure": "Pa",
        "force": "N",
        "position": "m",
        "velocity": "m/s",
        "flow": "m3/h",
        "upstream_pressure": "Pa",
        "downstream_pressure": "Pa",
        "temperature": "degC",
    }
)
"""The names the toolkit understands and their usual unit; signals of other names are carried along."""


@dataclass(frozen=True)
class SignalSpec:
    """A signal without its values: what a recording declares about it.

    name : name in the file, one of `UNDERSTOOD` or free; unit : symbol of `values`; role : one of `ROLES`;
    description : one line; resolution : quantisation step, in `unit`; noise_std : standard deviation of the sensor
    noise, in `unit`.

    Raises `BadInput` naming the field that is not allowed.
    """

    name: str
    unit: str
    role: Role
    description: str | None = None
    resolution: float | None = None
    noise_std: float | None = None

    def __post_init__(self) -> None:
        problem = _name_problem(self.name) or _field_problem(self)
        if problem:
            raise BadInput(f"/signals/{self.name}", *problem)

    @property
    def label(self) -> str:
        """Name and unit for an axis: ``position [m]``."""
        return f"{self.name} [{self.unit}]"


@dataclass(frozen=True, eq=False, repr=False)
class Signal:
    """One measured quantity, `values` of shape (n_samples,) in `unit`; missing samples are NaN.

    The values are read-only; a writable array is copied. The other fields are those of `SignalSpec`.

    >>> travel = Signal("position", np.array([0.0, 12.5, np.nan]), "mm", "output")
    >>> travel.si().values[1], travel.si().unit
    (np.float64(0.0125), 'm')
    """

    name: str
    values: Array
    unit: str
    role: Role
    description: str | None = None
    resolution: float | None = None
    noise_std: float | None = None

    def __post_init__(self) -> None:
        values = _frozen(self.values)
        if values.ndim != 1:
            found = f"the values have {values.ndim} dimensions"
            raise BadInput(f"/signals/{self.name}", found, "give one value a sample, shape (n_samples,)")
        object.__setattr__(self, "values", values)
        _ = self.spec  # building it checks the other fields

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        return f"<Signal {self.spec.label}, {self.role}, {len(self)} samples>"

    @property
    def spec(self) -> SignalSpec:
        """Everything but the values."""
        return SignalSpec(**{field.name: getattr(self, field.name) for field in fields(SignalSpec)})

    @classmethod
    def of(cls, spec: SignalSpec, values: Array) -> Signal:
        """The signal of a specification and its values, shape (n_samples,)."""
        return cls(values=values, **{field.name: getattr(spec, field.name) for field in fields(SignalSpec)})

    def si(self, stroke_m: float | None = None) -> Signal:
        """The same signal in SI units; itself when it is already.

        A `position` in % or 1 is a share of the stroke and becomes metres with `stroke_m`.

        Raises
        ------
        BadInput
            The unit is not known, or the position is a share of a stroke nobody gave.
        """
        own = unit(self.unit, f"signal '{self.name}'")
        scale, offset, symbol = own.scale, own.offset, own.si
        if self.name == "position" and own.si == "1":
            scale, symbol = scale * _known_stroke(stroke_m, self.unit), "m"
        if (scale, offset, symbol) == (1.0, 0.0, self.unit):
            return self
        return replace(
            self,
            values=_frozen(self.values * scale + offset),
            unit=symbol,
            resolution=None if self.resolution is None else self.resolution * scale,
            noise_std=None if self.noise_std is None else self.noise_std * scale,
        )


def _known_stroke(stroke_m: float | None, symbol: str) -> float:
    if stroke_m is None:
        remedy = "give the plant's stroke_m (in a recording: the attribute stroke_m of /plant)"
        raise BadInput("signal 'position'", f"it is in '{symbol}' of a stroke that is not known", remedy)
    return stroke_m


def unit_problem(name: str, symbol: str) -> tuple[str, str] | None:
    """What is wrong with the unit of a signal, as (found, remedy); None when it is fine.

    A name the toolkit understands needs a unit it can convert; any other name may carry any unit.
    """
    if not symbol.strip():
        return "the unit is empty", "give a unit symbol such as m, N, Pa, % or 1"
    if name == "time":
        return None if symbol == "s" else (f"the unit of time is '{symbol}'", "time is in 's': convert it")
    if name not in UNDERSTOOD:
        return None
    usual, found = unit(UNDERSTOOD[name]), find_unit(symbol)
    allowed = siblings(usual.si) + (", 1, %" if name == "position" else "")
    if found is None:
        return f"the unit '{symbol}' is not known", f"allowed for {name}: {allowed}"
    if found.si != usual.si and not (name == "position" and found.si == "1"):
        return f"'{symbol}' is not a unit of {name}", f"allowed for {name}: {allowed}"
    return None


def text_problem(text: Any) -> str | None:
    """Why a text cannot be stored in a file; None when it can."""
    if not isinstance(text, str):
        return f"{type(text).__name__} is not text"
    if "\0" in text:
        return "the text holds a NUL character"
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        return "the text holds half a character (a lone surrogate)"
    return None


def _name_problem(name: Any) -> tuple[str, str] | None:
    wrong = text_problem(name)
    if wrong or not name.strip() or "/" in name or name in {".", ".."}:
        found = wrong or f"'{name}' cannot be the name of a signal"
        return found, "a name is not empty, not '.' or '..', and holds no '/'"
    return None


def _field_problem(spec: SignalSpec) -> tuple[str, str] | None:
    for name in ("unit", "description"):
        wrong = None if getattr(spec, name) is None and name != "unit" else text_problem(getattr(spec, name))
        if wrong:
            return f"{name}: {wrong}", f"{name} is one line of text"
    if spec.role not in ROLES:
        return f"the role is '{spec.role}'", f"allowed: {', '.join(ROLES)}"
    for name in ("resolution", "noise_std"):
        number = getattr(spec, name)
        if number is not None and not (math.isfinite(number) and number >= 0):
            return f"{name} is {number}", f"{name} is a finite number of 0 or more, in the signal's unit"
    return unit_problem(spec.name, spec.unit)


def _frozen(values: Any) -> Array:
    """A read-only float64 array: the given one if nobody can write to it, else a copy."""
    array = np.asarray(values, dtype=np.float64)
    if array.flags.writeable:
        # A conversion has made a fresh array already; only an array that the caller still holds is copied.
        array = array.copy() if array is values or array.base is not None else array
        array.flags.writeable = False
    return array
