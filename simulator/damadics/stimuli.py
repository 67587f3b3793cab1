"""What the process does to the actuator: set point, pressures, temperature and supply over time.

A stimulus is a function of time, see `Stimulus`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from recordings import Array

Stimulus = Callable[[Array], Array]
"""From times (n,) [s] to CV [share of closing], P1, P2 [Pa], T1 [degC], Pz [Pa, relative], shape (n, 5)."""

SUPPLY = 600e3
"""Supply pressure of the benchmark model [Pa, relative]."""

_P1, _P2 = 3.5e6, 2.6e6


def constant(cv: float, *, p1: float = _P1, p2: float = _P2, t1: float = 20.0, pz: float = SUPPLY) -> Stimulus:
    """Nothing changes.

    cv : share of closing; p1, p2 : pressures [Pa]; t1 : temperature [degC]; pz : supply [Pa, relative].

    >>> constant(0.5)(np.array([0.0])).tolist()
    [[0.5, 3500000.0, 2600000.0, 20.0, 600000.0]]
    """
    return lambda t: _columns(t, np.full(len(t), cv), p1, p2, t1, pz)


def step_one(t: Array) -> Array:
    """Step I of the benchmark: sines of 0.01 Hz on CV, 0.1 Hz on P1 and 1/pi Hz on P2; 43 degC (DABLib's generator).

    t (n,) [s]; gives (n, 5), as `Stimulus`.
    """
    cv = 0.5 + 0.25 * np.sin(0.02 * np.pi * t)
    return _columns(t, cv, _P1 + 175e3 * np.sin(0.2 * np.pi * t), _P2 + 26e3 * np.sin(2.0 * t), 43.0)


def step_one_square(t: Array) -> Array:
    """Step I with a square wave of 5 % and 40 s on CV, so that friction faults show every 20 s. Ours, not published.

    t (n,) [s]; gives (n, 5), as `Stimulus`.
    """
    columns = step_one(t)
    columns[:, 0] += np.where(np.mod(t, 40.0) < 20.0, 0.05, -0.05)
    return columns


def chapter5(t: Array) -> Array:
    """Open and close: CV as read from Fig. 5(f) and 6(f) of Papadimitropoulos et al., SAFEPROCESS 2003.

    t (n,) [s]; gives (n, 5), as `Stimulus`.
    """
    return _columns(t, _staircase(t, ((0, 1), (20, 0), (30, 1), (40, 0), (50, 1), (60, 0), (80, 1))))


def example_one(t: Array) -> Array:
    """Example I of DABLib: half open, closing from 25 s.

    t (n,) [s]; gives (n, 5), as `Stimulus`.
    """
    return _columns(t, _staircase(t, ((0, 0.5), (25, 1))))


def recorded(time: Array, columns: Array) -> Stimulus:
    """A stimulus measured elsewhere: times (m,) [s] and columns (m, 5) as a `Stimulus` gives, linear in between."""
    return lambda t: np.column_stack([np.interp(t, time, column) for column in np.asarray(columns, float).T])


def _staircase(t: Array, steps: tuple[tuple[float, float], ...]) -> Array:
    starts, values = np.array(steps, float).T
    return values[np.maximum(np.searchsorted(starts, t, side="right") - 1, 0)]


def _columns(
    t: Array, cv: Array, p1: float | Array = _P1, p2: float | Array = _P2, t1: float = 20.0, pz: float = SUPPLY
) -> Array:
    columns = np.empty((len(t), 5))
    for number, values in enumerate((cv, p1, p2, t1, pz)):
        columns[:, number] = values
    return columns
