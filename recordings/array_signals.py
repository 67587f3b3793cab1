"""Signals made of arrays, and of the columns of a data frame: the way into a recording without a file."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Mapping
from typing import Any, Protocol

import numpy as np

from recordings.arrays import Array
from recordings.column_headers import split_unit
from recordings.errors import BadParameter
from recordings.signal import UNDERSTOOD, Role, Signal
from recordings.stored_units import stored_signal
from recordings.units import convert

USUAL_ROLES: Mapping[str, Role] = {
    "time": "time",
    "setpoint": "input",
    "drive": "input",
    "pressure": "input",
    "force": "input",
    "position": "output",
}
"""The roles of signals nobody gave one; any other is an extra."""


class DataFrameLike(Protocol):
    """What is needed of a data frame: pandas has it, and so have others. ``frame[name].to_numpy()`` gives a column."""

    @property
    def columns(self) -> Iterable[Hashable]:
        """The labels of the columns."""

    def __getitem__(self, label: Any, /) -> Any:
        """A column, which has ``to_numpy()``."""


def signals_of_arrays(
    arrays: Mapping[str, Any],
    units: Mapping[str, str] | None = None,
    roles: Mapping[str, Role] | None = None,
    stroke_m: float | None = None,
) -> list[Signal]:
    """The signals of arrays by name, each of shape (n_samples,), in the units in which a recording stores them.

    units : by name, those of `UNDERSTOOD` where not given; roles : by name, `USUAL_ROLES` where not given; stroke_m :
    stroke of the valve [m], by which a position in % becomes metres.

    Raises `BadParameter` for an array that holds no numbers, for a unit or a role of a signal that is not there, and
    for a signal of another name without a unit; `BadInput` for a unit that does not fit the signal.
    """
    units, roles = units or {}, roles or {}
    for parameter, given in (("units", units), ("roles", roles)):
        for name in set(given) - set(arrays):
            raise BadParameter(parameter, name, "there is no such signal", f"signals: {', '.join(arrays)}")
    return [
        _signal(name, _numbers(name, array), units.get(name), roles.get(name), stroke_m)
        for name, array in arrays.items()
    ]


def arrays_of_frame(
    frame: DataFrameLike, columns: Mapping[str, Hashable] | None = None, units: Mapping[str, str] | None = None
) -> tuple[dict[str, Any], dict[str, str]]:
    """The columns of a data frame by signal, shape (n_samples,) each, and their units.

    columns : label of the column of each signal; where not given, the columns whose header says a known name, such as
    ``position``, ``Force [kN]`` or ``time_ms``. The time is found by its header where `columns` does not name it.
    units : by signal; they go before those in the headers.

    Raises `BadParameter` for a column that is not there, for two columns of one signal, and when there is no time.
    """
    wanted = set(UNDERSTOOD) if columns is None else {"time"} - set(columns)
    chosen = _known_columns(frame, wanted) | dict(columns or {})
    labels = list(frame.columns)
    there = ", ".join(str(label) for label in labels)
    if "time" not in chosen:
        raise BadParameter("columns", "time", "no column is the time", f"name it; columns there: {there}")
    for name, label in chosen.items():
        if label not in labels:
            raise BadParameter("columns", name, f"there is no column '{label}'", f"columns there: {there}")
    headers = {name: split_unit(str(label))[1] for name, label in chosen.items()}
    found = {name: symbol for name, symbol in headers.items() if symbol is not None}
    return {name: frame[label].to_numpy() for name, label in chosen.items()}, found | dict(units or {})


def _known_columns(frame: DataFrameLike, wanted: Collection[str]) -> dict[str, Hashable]:
    """Labels of the columns whose header says one of some names, by that name."""
    known: dict[str, Hashable] = {}
    for label in frame.columns:
        word = split_unit(str(label))[0].casefold()
        name = "time" if word == "t" else word
        if name in known:
            found = f"the columns '{known[name]}' and '{label}' both say that they are it"
            raise BadParameter("columns", name, found, "name the one that is meant")
        if name in wanted:
            known[name] = label
    return known


def _numbers(name: str, array: Any) -> Array:
    """An array as floating-point numbers; times of day as seconds since the first one."""
    values = np.asarray(array)
    if name == "time" and values.dtype.kind == "M" and values.size:
        return np.asarray((values - values.flat[0]) / np.timedelta64(1, "s"), np.float64)
    try:
        return np.asarray(values, np.float64)
    except (TypeError, ValueError) as error:
        found = f"it holds something else than numbers ({' '.join(str(error).split())[:80]})"
        raise BadParameter(name, "", found, "give an array of numbers, NaN where a sample is missing") from None


def _signal(name: str, values: Array, symbol: str | None, role: Role | None, stroke_m: float | None) -> Signal:
    symbol, where = symbol or UNDERSTOOD.get(name), f"units: {name}"
    if symbol is None:
        remedy = f"give one, as in units={{'{name}': 'mm'}}; '1' for a number without"
        raise BadParameter("units", name, "its unit is not given", remedy)
    if name == "time":
        return Signal("time", convert(values, symbol, "s", where), "s", "time")
    return stored_signal(name, values, symbol, role or USUAL_ROLES.get(name, "extra"), stroke_m, where)
