"""How much of PV the place of a valve explains, beside past values: many valves, every delay.

PV is regressed on `PAST` values before it, which stand for noise and disturbances of any colour, and on two values of
the valve behind one of many delays, neighbours: ARX, which integrating processes are, too. Where past values of OP are
there as well, they are what a linear process of high order makes of OP, and the valve explains what none does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from recordings import Array

PAST, DELAYS = 20, 20
"""Past values of a signal; delays of the valve, in samples."""
FIRST = max(PAST, DELAYS + 1)
RIDGE = 1e-9
"""Of what is regressed on: one value of the output of a PI controller follows from the one before."""
BACK = np.arange(PAST)


@dataclass(frozen=True)
class ValveRegression:
    """signals (q, n) : PV, and perhaps OP, scaled; triangle (p, p) : Cholesky factor of a constant and of their past
    values; along (p,) : PV along them; left : squared error of PV without a valve. p = 1 + q PAST.
    """

    signals: Array
    triangle: Array
    along: Array
    left: float

    @classmethod
    def of(cls, *signals: Array) -> ValveRegression:
        """For a PV, and perhaps an OP, (n,), about zero and of about one in size; n is more than `FIRST` + p."""
        y, n = signals[0][FIRST:], len(signals[0])
        past = [values[FIRST - i : n - i] for values in signals for i in range(1, PAST + 1)]
        held = np.column_stack([np.ones(len(y)), *past])
        triangle = np.linalg.qr(np.vstack([held, np.sqrt(RIDGE * len(y)) * np.eye(held.shape[1])])).R
        along = solve_triangular(triangle, held.T @ y, trans="T")
        return cls(np.stack(signals), triangle, along, float(y @ y - along @ along))

    @property
    def n(self) -> int:
        """Degrees of freedom of the errors."""
        return max(1, self.signals.shape[1] - FIRST - len(self.along) - 2)

    def errors(self, valves: Array) -> Array:
        """Squared errors (k,) with valves (k, n), each at its best delay."""
        return np.maximum(self.left - self._explained(valves), 1e-12)

    def static_gain(self, valve: Array) -> float:
        """PV over one valve (n,) at rest, in the units of both, at the best delay."""
        pv, n = self.signals[0], self.signals.shape[1]
        past = [np.ones(n - FIRST), *(values[FIRST - i : n - i] for values in self.signals for i in 1 + BACK)]
        fits = [
            _least_squares(np.column_stack([*past, *(valve[FIRST - k : n - k] for k in (lag, lag + 1))]), pv[FIRST:])
            for lag in range(1, DELAYS)
        ]
        found, _ = min(fits, key=lambda one: one[1])
        return float(found[-2:].sum() / (1 - found[1 : PAST + 1].sum()))

    def _explained(self, valves: Array) -> Array:
        """Sum of squares (k,) that valves (k, n) explain of PV.

        Sums over products of lagged values differ from lag to lag by their ends only.
        """
        most, sums = np.zeros(len(valves)), _LaggedSums.of(self.signals, valves)
        one = self._without_past(sums)
        for lag in range(1, DELAYS + 1):
            further = sums.further(self.signals, valves, lag)
            two = self._without_past(further)
            most = np.maximum(most, _explain(one, two, sums, further))
            sums, one = further, two
        return most

    def _without_past(self, sums: _LaggedSums) -> tuple[Array, Array]:
        """Valves along the past, (p, k), and their products with what it leaves of PV, (k,)."""
        past = np.vstack([sums.total, *(one[1:] for one in sums.signals)])
        along = solve_triangular(self.triangle, past, trans="T", check_finite=False)
        return along, sums.signals[0][0] - self.along @ along


@dataclass(frozen=True)
class _LaggedSums:
    """Sums over samples of valves (k, n) of one lag: with signals of lags 0 to PAST (PAST + 1, k), by themselves,
    squared, and with their own values one lag further (k,)."""

    signals: tuple[Array, ...]
    total: Array
    square: Array
    cross: Array

    @classmethod
    def of(cls, signals: Array, valves: Array) -> _LaggedSums:
        """Of lag 1."""
        n = signals.shape[1]
        now, before = valves[:, FIRST - 1 : n - 1], valves[:, FIRST - 2 : n - 2]
        lagged = [np.stack([values[FIRST - i : n - i] for i in range(PAST + 1)]) for values in signals]
        squares = (np.einsum("ij,ij->i", now, other) for other in (now, before))
        return cls(tuple(one @ now.T for one in lagged), now.sum(axis=1), *squares)

    def further(self, signals: Array, valves: Array, lag: int) -> _LaggedSums:
        """Of lag `lag` + 1, from those of `lag`."""
        n = signals.shape[1]
        enters, leaves = valves[:, FIRST - 1 - lag], valves[:, n - 1 - lag]
        now = valves[:, FIRST - 1 - lag : n - 1 - lag]
        moved = [
            sums[:-1] + np.outer(values[FIRST - 1 - BACK], enters) - np.outer(values[n - 1 - BACK], leaves)
            for values, sums in zip(signals, self.signals, strict=True)
        ]
        more = tuple(np.vstack([now @ values[FIRST:], one]) for values, one in zip(signals, moved, strict=True))
        cross = self.cross
        if lag < DELAYS:
            cross = cross + enters * valves[:, FIRST - 2 - lag] - leaves * valves[:, n - 2 - lag]
        return _LaggedSums(more, self.total + enters - leaves, self.square + enters**2 - leaves**2, cross)


def _least_squares(given: Array, y: Array) -> tuple[Array, float]:
    """Coefficients (k,), and the squared error."""
    found = np.asarray(np.linalg.lstsq(given, y)[0], float)
    return found, float(np.sum((y - given @ found) ** 2))


def _explain(one: tuple[Array, Array], two: tuple[Array, Array], sums: _LaggedSums, further: _LaggedSums) -> Array:
    """What two neighbouring values of each valve explain together, with a ridge."""
    (a, gift), (b, other) = one, two
    p = sums.square * (1 + RIDGE) - np.einsum("ij,ij->j", a, a)
    q = further.square * (1 + RIDGE) - np.einsum("ij,ij->j", b, b)
    r = sums.cross - np.einsum("ij,ij->j", a, b)
    whole = np.maximum(p * q - r**2, 1e-300)
    return np.asarray((q * gift**2 - 2 * r * gift * other + p * other**2) / whole, float)
