"""Velocity from position: a Kalman filter, its steady form for speed, a high-pass filter, or the measured velocity.

The residual is an acceleration, so two poles are the least a filter needs: the high-pass filter of Section 5.3 has one
and serves noise-free data only. Every filter is pure: state in, state out; one sample is a run of length one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import exp, expm1, log2
from typing import Any, Protocol

import numpy as np

from detector.arithmetic.native import inlined, native
from recordings import Array, BadInput

_UNSURE = 1e6
"""Initial variances of velocity and acceleration, over the intensity of the jerk: as good as unknown."""


class Velocity(Protocol):
    """A filter from positions to velocities."""

    def start(self) -> Array:
        """The state before the first sample."""

    def run(self, state: Array, dt: Array, position: Array, velocity: Array) -> tuple[Array, Array, Array]:
        """Over samples, all (n_samples,). dt : time since the sample before [s]; 0 restarts, NaN skips the sample.

        Returns the state afterwards, and position and velocity (n_samples,), NaN where a sample was skipped.
        """


@dataclass(frozen=True)
class Measured:
    """The velocity comes with the samples (Assumption 1)."""

    def start(self) -> Array:
        """Nothing to remember."""
        return np.zeros(0)

    def run(self, state: Array, dt: Array, position: Array, velocity: Array) -> tuple[Array, Array, Array]:
        """The samples as they are, NaN where skipped."""
        used = ~np.isnan(dt)
        return state, np.where(used, position, np.nan), np.where(used, velocity, np.nan)


@dataclass(frozen=True)
class HighPass:
    """x2 = s / (tau s + 1) x1, exact for positions linear from sample to sample; Section 5.3, for data without noise.

    tau_s : time constant [s].
    """

    tau_s: float = 1e-3

    def start(self) -> Array:
        """Position and velocity last made."""
        return np.zeros(2)

    def run(self, state: Array, dt: Array, position: Array, velocity: Array) -> tuple[Array, Array, Array]:
        """See `Velocity.run`; the position is passed through."""
        _positive(self.tau_s, "tau_s")
        after, x1, x2 = _prepared(state, dt)
        _high_pass(after, dt, position, self.tau_s, x1, x2)
        return after, x1, x2


@native
def _high_pass(state: Array, dt: Array, position: Array, tau: float, x1: Array, x2: Array) -> None:
    for i in range(dt.shape[0]):
        if dt[i] == 0.0:
            state[1] = 0.0
        elif dt[i] > 0.0:
            slope = (position[i] - state[0]) / dt[i]
            state[1] = exp(-dt[i] / tau) * state[1] - expm1(-dt[i] / tau) * slope
        if dt[i] >= 0.0:
            state[0] = position[i]
            x1[i], x2[i] = position[i], state[1]


@dataclass(frozen=True)
class Kalman:
    """Constant-acceleration Kalman filter driven by white jerk; filterpy does the arithmetic.

    noise : standard deviation of the position; jerk : intensity of the white jerk, in (unit/s^3)^2 s. Any sampling,
    regular or not, and after a start or a gap at once as sure as it can be: it is what runs where one valve is watched.
    `SteadyKalman` is the same filter after its start, compiled, for fleets.
    """

    noise: float
    jerk: float

    def start(self) -> Array:
        """State (3) and covariance (3, 3), flat."""
        return np.zeros(12)

    def run(self, state: Array, dt: Array, position: Array, velocity: Array) -> tuple[Array, Array, Array]:
        """See `Velocity.run`; the position is the filtered one."""
        after, x1, x2 = _prepared(state, dt)
        filter = self._filter
        filter.x, filter.P = after[:3].reshape(3, 1), after[3:].reshape(3, 3)
        for i, step in enumerate(dt.tolist()):
            if step == 0.0:
                filter.x = np.array([[position[i]], [0.0], [0.0]])
                filter.P = np.diag([self.noise**2, *[_UNSURE * self.jerk] * 2])
            elif step > 0.0:
                filter.predict(F=transition(step), Q=self.jerk * jerk_covariance(step))
                filter.update(position[i])
            if step >= 0.0:
                x1[i], x2[i] = filter.x[0, 0], filter.x[1, 0]
        return np.concatenate([filter.x.ravel(), filter.P.ravel()]), x1, x2

    @cached_property
    def _filter(self) -> Any:
        """filterpy's object. Whatever it remembers is set before use, so that it holds no state of a valve."""
        from filterpy.kalman import KalmanFilter

        _positive(self.noise, "noise")
        _positive(self.jerk, "jerk")
        filter = KalmanFilter(dim_x=3, dim_z=1)
        filter.H, filter.R = np.array([[1.0, 0.0, 0.0]]), np.array([[self.noise**2]])
        filter.inv = _reciprocal
        return filter


def _reciprocal(matrix: Array) -> Array:
    """The inverse of a matrix (1, 1), for which a general routine would take longer than all the rest."""
    return np.asarray(1.0 / matrix)


@dataclass(frozen=True)
class SteadyKalman:
    """The filter `Kalman` with the gain it settles to, compiled.

    dt_s : nominal sampling time [s]. The gain is tabled from 1/32 to 32 times of it, interpolated in its logarithm and
    held beyond, so samples may come irregularly. noise, jerk : as in `Kalman`.
    """

    noise: float
    jerk: float
    dt_s: float

    def start(self) -> Array:
        """Position, velocity, acceleration."""
        return np.zeros(3)

    def run(self, state: Array, dt: Array, position: Array, velocity: Array) -> tuple[Array, Array, Array]:
        """See `Velocity.run`; the position is the filtered one."""
        after, x1, x2 = _prepared(state, dt)
        _steady(after, dt, position, self.dt_s, self.gains, x1, x2)
        return after, x1, x2

    @cached_property
    def gains(self) -> Array:
        """The settled gains for the tabled steps, times (1, dt, dt^2), shape (n_steps, 3)."""
        for name in ("noise", "jerk", "dt_s"):
            _positive(getattr(self, name), name)
        steps = self.dt_s * 2.0 ** (np.arange(-_OCTAVES * _PER_OCTAVE, _OCTAVES * _PER_OCTAVE + 1) / _PER_OCTAVE)
        return np.array([steady_gain(self.noise, self.jerk, step) for step in steps])


_OCTAVES, _PER_OCTAVE = 5, 4
_LARGEST_INDEX = 1e9
"""jerk dt^5 / noise^2 beyond which the filter follows the position, to nine digits."""


@inlined
def steady_gain_at(h: float, nominal: float, gains: Array) -> tuple[float, float, float]:
    """The gain for a step h [s] interpolated in the table of `SteadyKalman`, in the units of the state; 0 for h = 0."""
    if h == 0.0:
        return 0.0, 0.0, 0.0
    place = (log2(h / nominal) + _OCTAVES) * _PER_OCTAVE
    place = min(max(place, 0.0), gains.shape[0] - 1.0)
    j = min(int(place), gains.shape[0] - 2)
    part = place - j
    g0 = (1.0 - part) * gains[j, 0] + part * gains[j + 1, 0]
    g1 = (1.0 - part) * gains[j, 1] + part * gains[j + 1, 1]
    g2 = (1.0 - part) * gains[j, 2] + part * gains[j + 1, 2]
    return g0, g1 / h, g2 / (h * h)


@inlined
def track(
    x1: float, x2: float, x3: float, h: float, position: float, gain: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Position, velocity and acceleration after a step h [s] of the constant-acceleration filter; h = 0 restarts it."""
    if h == 0.0:
        return position, 0.0, 0.0
    x1 += h * (x2 + 0.5 * h * x3)
    x2 += h * x3
    miss = position - x1
    return x1 + gain[0] * miss, x2 + gain[1] * miss, x3 + gain[2] * miss


@native
def _steady(state: Array, dt: Array, position: Array, nominal: float, gains: Array, x1: Array, x2: Array) -> None:
    for i in range(dt.shape[0]):
        h = dt[i]
        if h >= 0.0:
            gain = steady_gain_at(h, nominal, gains)
            state[0], state[1], state[2] = track(state[0], state[1], state[2], h, position[i], gain)
            x1[i], x2[i] = state[0], state[1]


def negative_log_likelihood(noise: float, jerk: float, dt: float, position: Array) -> float:
    """Minus twice the mean log-likelihood of positions (n_samples,), dt [s] apart, under the settled filter."""
    gain, n_start = steady_gain(noise, jerk, dt), min(30, len(position) // 2)
    step, x1 = np.full(len(position), dt), np.empty(len(position))
    step[0] = 0.0
    _steady(np.zeros(3), step, position, dt, np.array([gain, gain]), x1, np.empty(len(position)))
    variance = noise**2 / (1.0 - gain[0])
    innovation = (position - x1)[n_start:] / (1.0 - gain[0])
    return float(np.mean(innovation**2) / variance + np.log(variance))


def transition(dt: float) -> Array:
    """Constant acceleration over dt [s], shape (3, 3)."""
    return np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])


def jerk_covariance(dt: float) -> Array:
    """What unit white jerk adds to the covariance over dt [s], shape (3, 3)."""
    q = [[dt**5 / 20, dt**4 / 8, dt**3 / 6], [dt**4 / 8, dt**3 / 3, dt**2 / 2], [dt**3 / 6, dt**2 / 2, dt]]
    return np.array(q)


def steady_gain(noise: float, jerk: float, dt: float) -> Array:
    """Gain that the constant-acceleration filter settles to, times (1, dt, dt^2): then it depends on one number only,
    jerk dt^5 / noise^2. Solved in those units, in which the Riccati equation is well scaled. Shape (3,).
    """
    return np.array(_settled(min(jerk * dt**5 / noise**2, _LARGEST_INDEX)))


@lru_cache(maxsize=4096)
def _settled(index: float) -> tuple[float, float, float]:
    """The gain of `steady_gain` for that number."""
    from scipy.linalg import solve_discrete_are

    # In units of time in which the filter settles in about one, and of position in which its variance is about one.
    step = min(index ** (1 / 6), 1.0)
    noise_variance = 1.0 / step if index < 1.0 else 1.0 / index
    h = np.array([[1.0, 0.0, 0.0]])
    cov = solve_discrete_are(transition(step).T, h.T, jerk_covariance(step), np.array([[noise_variance]]))
    first, second, third = (cov @ h.T / (h @ cov @ h.T + noise_variance)).ravel() * step ** np.arange(3.0)
    return float(first), float(second), float(third)


def _prepared(state: Array, dt: Array) -> tuple[Array, Array, Array]:
    """A copy of the state, and room for position and velocity."""
    return np.array(state, float), np.full(len(dt), np.nan), np.full(len(dt), np.nan)


def _positive(value: float, name: str) -> None:
    if not (np.isfinite(value) and value > 0):
        raise BadInput(f"velocity filter: {name}", f"it is {value}", "give a positive number")
