"""Parameter estimation that ends at physical parameters: mass, spring, friction, and not coefficients (3.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.arithmetic.native import native
from detector.generators.contract import Generator
from detector.generators.estimation import Estimation, learn_estimation
from recordings import Array, BadInput

SYMBOLS = ("m", "K", "viscous", "fc", "F0")
"""Mass [kg], spring rate [N/m], viscous friction [N s/m], Coulomb friction [N], force at position zero [N]."""

_ORDER = 3
_SETTLED = 12.0
"""Filtered signals have forgotten a jump of the friction after so many times 1 / corner, but for 0.05 % of it."""
_STATES = 2 * _ORDER + 4
"""Two filters of force and position, their readings before, the sign of the velocity and since when [s]."""


@dataclass(frozen=True, eq=False)
class PhysicalParameters(Generator):
    """(parameter - usual) / spread for each of `SYMBOLS`: m a + viscous v + fc sgn(v) + K x + F0 = u, on line.

    Input: force u [N]; output: position x [m]; regular readings, `dt` [s] apart. Both sides pass through
    (w / (s + w))^3, w = corner [rad/s], which also gives velocity and acceleration of the filtered position: no signal
    is differentiated, and the equation holds for filtered signals with the physical parameters themselves as
    coefficients, so the way back from coefficients (steps 2 and 4 of the source) is the identity. Only sliding counts:
    readings at which the velocity has kept its sign for as long as the filters remember. estimation : recursive least
    squares with forgetting over such readings; between them the estimates stay.
    """

    dt: float
    corner: float
    estimation: Estimation

    @property
    def width(self) -> tuple[int, int, int]:
        """One input, one output, a residual for each parameter."""
        return 1, 1, len(SYMBOLS)

    def initial(self) -> Array:
        """Filters unknown, the usual parameters."""
        return np.concatenate([np.full(_STATES, np.nan), np.zeros(len(SYMBOLS)), self.estimation.initial()])

    def parameters(self, residuals: Array) -> Array:
        """The parameters (n, 5) behind residuals, in SI units."""
        return self.estimation.estimates(residuals)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        filters, rows, force = filtered(state[:_STATES], u[:, 0], y[:, 0], self.dt, self.corner)
        now, known = state[_STATES : _STATES + len(SYMBOLS)], state[_STATES + len(SYMBOLS) :]
        known, found = self.estimation.run(known, rows, force[:, None])
        joined = np.vstack([now, found])
        last = np.maximum.accumulate(np.where(np.isfinite(joined).all(axis=1), np.arange(len(joined)), 0))
        residuals = joined[last][1:]
        return np.concatenate([filters, residuals[-1], known]), residuals


def filtered(state: Array, u: Array, x: Array, dt: float, corner: float) -> tuple[Array, Array, Array]:
    """The state after readings u [N], x [m] (n,), regressors (n, 5) in the order of `SYMBOLS`, and filtered force (n,);
    rows of NaN where nothing slides. Filters are exact for signals that are straight between readings.
    """
    matrices, state = _first_order_hold(dt, corner), np.array(state, float)
    if np.isnan(state).any():
        state = np.array([u[0], 0, 0, x[0], 0, 0, u[0], x[0], 0, 0], float)
    force, motion = np.empty((len(u), _ORDER)), np.empty((len(u), _ORDER))
    signs = np.empty(len(u))
    u, x = np.ascontiguousarray(u), np.ascontiguousarray(x)
    _run(state, *matrices, dt, _SETTLED / corner, 2 * _ORDER / corner, u, x, force, motion, signs)
    rows = np.column_stack([motion[:, 2], motion[:, 0], motion[:, 1], signs, np.ones(len(u))])
    rows[signs == 0] = np.nan
    return state, rows, force[:, 0]


def learn_physical(u: Array, x: Array, dt: float, *, corner: float = 0.0, memory_s: float = 5.0) -> PhysicalParameters:
    """Usual parameters and spreads from fault-free readings u [N], x [m] (n,), `dt` [s] apart.

    corner : of the filters [rad/s], a twentieth of the sampling's where 0 is given; memory_s : sliding [s] over which
    it forgets. Raises BadInput when the valve hardly slides, or does so at one speed, one way, only.
    """
    corner = corner or 2 * np.pi / dt / 20
    blank = np.full(_STATES, np.nan)
    _, rows, force = filtered(blank, u, x, dt, corner)
    settled = np.arange(len(u)) * dt > _SETTLED / corner
    sliding = np.isfinite(rows).all(axis=1) & settled
    if sliding.sum() < 100:
        found = f"{sliding.sum()} readings slide for longer than {_SETTLED / corner:.2g} s"
        raise BadInput("physical parameters", found, "give a motion to and fro, sampled faster")
    return PhysicalParameters(dt, corner, learn_estimation(rows[sliding], force[sliding], memory_s / dt))


def _first_order_hold(dt: float, corner: float) -> tuple[Array, Array, Array]:
    """How d3y/dt3 = w^3 (u - y) - 3 w^2 dy/dt - 3 w d2y/dt2 moves y and its derivatives over a step: by themselves, by
    the input before, and by its change over the dt.
    """
    from scipy.linalg import expm

    whole = np.zeros((_ORDER + 2, _ORDER + 2))
    whole[:_ORDER, :_ORDER] = dt * np.diag(np.ones(_ORDER - 1), 1)
    whole[_ORDER - 1, : _ORDER + 1] = dt * np.array([-(corner**3), -3 * corner**2, -3 * corner, corner**3])
    whole[_ORDER, _ORDER + 1] = 1.0
    moved = np.ascontiguousarray(expm(whole)[:_ORDER])
    return moved[:, :_ORDER].copy(), moved[:, _ORDER].copy(), moved[:, _ORDER + 1].copy()


@native
def _run(
    state: Array, own: Array, before: Array, change: Array, dt: float, settled: float, ahead: float, u: Array,
    x: Array, force: Array, motion: Array, signs: Array,
) -> None:  # fmt: skip
    """Both filters over readings, changing `state` in place; signs : of the velocity where it slides, 0 elsewhere."""
    n = own.shape[0]
    after = np.empty(n)
    for k in range(u.shape[0]):
        for which in range(2):
            now, first = (u[k] if which == 0 else x[k]), which * n
            past = state[2 * n + which]
            for i in range(n):
                after[i] = before[i] * past + change[i] * (now - past)
                for j in range(n):
                    after[i] += own[i, j] * state[first + j]
            for i in range(n):
                state[first + i] = after[i]
                if which == 0:
                    force[k, i] = after[i]
                else:
                    motion[k, i] = after[i]
            state[2 * n + which] = now
        # The filters are late: near a reversal the friction has turned before their velocity has.
        sign = np.sign(motion[k, 1]) if motion[k, 1] * (motion[k, 1] + ahead * motion[k, 2]) > 0.0 else 0.0
        state[2 * n + 3] = state[2 * n + 3] + dt if sign == state[2 * n + 2] else 0.0
        state[2 * n + 2] = sign
        signs[k] = sign if state[2 * n + 3] >= settled else 0.0
