"""A qualitative envelope: all behaviours of a monotone lag whose curve and time constant are known only as ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.arithmetic.native import native
from detector.generators.contract import Generator
from recordings import Array, BadInput

_KNOTS = 33


@dataclass(frozen=True, eq=False)
class Envelope(Generator):
    """How far y is outside of what T dy/dt = g(u) - y allows, in widths of the envelope's static part; 0 inside.

    Known is that g rises or falls all the way, that it lies between `low` and `high`, (n_knots,) each over rising
    `knots` of u, and that the lag T is between lags[0] and lags[1], in readings. The right-hand side rises in g and the
    system is of first order, so the two extreme solutions enclose every one of these behaviours, whichever g and T it
    has, even if they change (comparison theorem). While the envelope holds the valve, no alarm is false.

    After Kay and Kuipers, AAAI 1993: envelopes of semi-quantitative models.
    """

    knots: Array
    low: Array
    high: Array
    lags: tuple[float, float]

    @property
    def width(self) -> tuple[int, int, int]:
        """One input, one output, one residual."""
        return 1, 1, 1

    def initial(self) -> Array:
        """Nothing known: the first reading may be anywhere between the extremes."""
        return np.full(2, np.nan)

    def bounds(self, state: Array, u: Array) -> tuple[Array, Array]:
        """State after inputs u (n,) and the envelope (n, 2): lowest and highest y."""
        lowest, highest = np.interp(u, self.knots, self.low), np.interp(u, self.knots, self.high)
        out, now = np.empty((len(u), 2)), np.array(state, float)
        if np.isnan(now).any():
            now = np.array([self.low.min(), self.high.max()])
        shares = 1 - np.exp(-1 / np.maximum(np.array(self.lags), 1e-9))
        _enclose(now, lowest, highest, float(shares[0]), float(shares[1]), out)
        return now, out

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        after, bounds = self.bounds(state, u[:, 0])
        wide = float(np.mean(self.high - self.low)) + 1e-12
        over = np.maximum(y[:, 0] - bounds[:, 1], 0.0) - np.maximum(bounds[:, 0] - y[:, 0], 0.0)
        return after, (over / wide)[:, None]


@native
def _enclose(now: Array, low: Array, high: Array, fast: float, slow: float, out: Array) -> None:
    """Extreme solutions over readings, the input held between them: each way as fast or as slow as may be."""
    for k in range(low.shape[0]):
        away = low[k] - now[0]
        now[0] += away * (fast if away < 0.0 else slow)
        away = high[k] - now[1]
        now[1] += away * (slow if away < 0.0 else fast)
        out[k, 0], out[k, 1] = now[0], now[1]


def learn_envelope(u: Array, y: Array, spread: float = 3.0) -> Envelope:
    """From fault-free rows u (n,), y (n,): a monotone g by isotonic least squares, bounds that hold all rows, and lags
    from 1/spread to spread times the one that suits best.

    Raises BadInput for fewer than 100 rows, or a u that does not vary.
    """
    if len(u) < 100 or not np.ptp(u) > 0:
        raise BadInput("envelope", f"{len(u)} readings that vary by {np.ptp(u):g}", "give 100 that vary")
    knots = np.linspace(float(np.min(u)), float(np.max(u)), _KNOTS)
    tried = [(_fit(u, y, lag, knots), lag) for lag in (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)]
    (curve, _), lag = min(tried, key=lambda one: one[0][1])
    lags = (lag / spread, lag * spread)
    below = above = 1e-9
    for _ in range(60):
        wide = Envelope(knots, curve - below, curve + above, lags)
        _, bounds = wide.bounds(wide.initial(), u)
        under, over = float(np.max(bounds[:, 0] - y)), float(np.max(y - bounds[:, 1]))
        if max(under, over) <= 0:
            break
        # A bound that is moved carries the envelope with it, late by its lag: so a little at a time.
        below, above = below + max(under, 0.0) * 1.05, above + max(over, 0.0) * 1.05
    return wide


def _fit(u: Array, y: Array, lag: float, knots: Array) -> tuple[Array, float]:
    """The monotone curve over knots for a lag, and its mean squared error; the lag acts first, then the curve."""
    from scipy.optimize import isotonic_regression
    from scipy.signal import lfilter

    share = 1 - np.exp(-1 / lag)
    late = lfilter([share], [1, share - 1], u, zi=[u[0] * (1 - share)])[0]
    order = np.argsort(late)
    rising = bool(np.polyfit(late, y, 1)[0] > 0)
    fitted = isotonic_regression(y[order], increasing=rising).x
    curve = np.interp(knots, late[order], fitted)
    return curve, float(np.mean((y - np.interp(late, knots, curve)) ** 2))
