"""In which unit a recording stores a signal, and the signal in it: what importers and arrays go through."""

from __future__ import annotations

import numpy as np

from recordings.arrays import Array
from recordings.signal import UNDERSTOOD, Role, Signal
from recordings.units import convert, find_unit


def stored_signal(
    name: str,
    values: Array,
    symbol: str,
    role: Role,
    stroke_m: float | None,
    where: str,
    *,
    description: str | None = None,
    resolution: float | None = None,
    noise_std: float | None = None,
) -> Signal:
    """The signal of values, shape (n_samples,), in any unit: converted as `stored_unit` says, infinite ones missing.

    stroke_m : stroke of the valve [m], by which a position in % becomes metres; resolution, noise_std : in the unit of
    the values; where : whose values they are, for messages. Raises `BadInput` for a unit that does not fit the name.
    """
    target, factor, stored = stored_unit(name, symbol, stroke_m)
    with np.errstate(over="ignore"):
        values = factor * _converted(values, symbol, target, where)
    values[~np.isfinite(values)] = np.nan  # infinite is no measurement
    scale = factor * _step(symbol, target, where)
    return Signal(
        name=name,
        values=values,
        unit=stored,
        role=role,
        description=description,
        resolution=None if resolution is None else resolution * scale,
        noise_std=None if noise_std is None else noise_std * scale,
    )


def stored_unit(name: str, symbol: str, stroke_m: float | None) -> tuple[str, float, str]:
    """The unit a signal is converted to, a factor after that, and the unit of the result.

    Signals that the toolkit understands get their usual unit, so that any reader of the file can do without a table;
    shares stay shares, except that of a position when the stroke is known.

    >>> stored_unit("position", "mm", None), stored_unit("position", "%", 0.04)
    (('m', 1.0, 'm'), ('1', 0.04, 'm'))
    """
    found = find_unit(symbol)
    share = found is not None and found.si == "1"
    if share and name == "position" and stroke_m is not None:
        return "1", stroke_m, "m"
    if name in UNDERSTOOD and not (share and name in {"position", "setpoint", "drive"}):
        return UNDERSTOOD[name], 1.0, UNDERSTOOD[name]
    usual = found.symbol if found else symbol
    return usual, 1.0, usual


def _converted(values: Array, source: str, target: str, where: str) -> Array:
    return values if source == target else convert(values, source, target, where)


def _step(source: str, target: str, where: str) -> float:
    """How large one step in `source` is in `target`; units with an offset have steps too."""
    return 1.0 if source == target else convert(1.0, source, target, where) - convert(0.0, source, target, where)
