"""The steps of a Kalman filter, and the smoother of a force that is a chain of integrals, compiled by numba.

This file is compiled from its text (`simulator.native_module`), so it imports nothing of ours, and nothing
imports it. What stands before the mark serves the filter of a linearised model as well (`estimators/noise_aware/`).

Shapes: n samples, s states, m free parameters.
"""

# mypy: disallow_untyped_decorators=False
from __future__ import annotations

from typing import Any

import numba
import numpy as np

native = numba.njit(error_model="numpy", nogil=True)
number, vector, matrix, cube = numba.float64, numba.float64[::1], numba.float64[:, ::1], numba.float64[:, :, ::1]


@native
def update(a: Any, P: Any, S: Any, h: Any, J: Any, e: float, r: float, K: Any) -> float:
    """Take one scalar measurement into mean a, covariance P and sensitivities S.

    h (s,) : its row; J (m,) : how the innovation falls with the parameters; e : innovation; r : noise variance;
    K (s,) is filled with the gain. Returns the variance of the innovation. Joseph's form, which stays positive where a
    measurement is far better than what is known before it, would take three times as long: here it never is.
    """
    s = a.shape[0]
    for i in range(s):
        K[i] = 0.0
        for j in range(s):
            K[i] += P[i, j] * h[j]
    variance = r
    for i in range(s):
        variance += h[i] * K[i]
    for i in range(s):
        gain = K[i] / variance
        a[i] += gain * e
        for j in range(J.shape[0]):
            S[i, j] -= gain * J[j]
        for j in range(i + 1):
            P[i, j] -= gain * K[j]
            P[j, i] = P[i, j]
    for i in range(s):
        K[i] /= variance
    return variance


@native
def predict(a: Any, P: Any, S: Any, F: Any, G: Any, jump: Any, Q: Any, b: Any, T: Any, U: Any) -> None:
    """Carry mean, covariance and sensitivities over one interval; b (s,), T (s, s), U (s, m) : room."""
    s, m = S.shape
    for i in range(s):
        b[i] = jump[i]
        for j in range(s):
            b[i] += F[i, j] * a[j]
            T[i, j] = 0.0
            for k in range(s):
                T[i, j] += F[i, k] * P[k, j]
        for j in range(m):
            U[i, j] = G[i, j]
            for k in range(s):
                U[i, j] += F[i, k] * S[k, j]
    for i in range(s):
        a[i] = b[i]
        for j in range(m):
            S[i, j] = U[i, j]
        for j in range(i + 1):
            value = Q[i, j]
            for k in range(s):
                value += T[i, k] * F[j, k]
            P[i, j] = value
            P[j, i] = value


# The force

DIFFUSE = 4
"""Samples that tell where a chain of integrals starts, which is not known."""


@native
def chained(h: float, w: float, unit: float, F: Any, Q: Any) -> None:
    """Transition F and covariance Q of a chain of integrals over a time h, its last state driven by noise of intensity
    w; states are derivatives times powers of `unit` [s], which keeps them of one size.
    """
    last = F.shape[0] - 1
    driven = w * h * unit ** (2 * last)
    for i in range(last + 1):
        F[i, i] = 1.0
        for j in range(i + 1, last + 1):
            F[i, j] = F[i, j - 1] * h / (unit * (j - i))
    for i in range(last + 1):
        for j in range(last + 1):
            Q[i, j] = driven * F[i, last] * F[j, last] / (2 * last - i - j + 1)


@native
def conditioned(row: Any, own: float, pull: Any, N: Any) -> tuple[float, float]:
    """Shift of the mean and variance of a quantity when all data are known, from its variance `own` and its covariance
    `row` (s,) with the states that the adjoint `pull` (s,), of covariance N, is of."""
    shift, variance = 0.0, own
    for i in range(row.shape[0]):
        shift += row[i] * pull[i]
        for j in range(row.shape[0]):
            variance -= row[i] * N[i, j] * row[j]
    return shift, variance


@native
def back_over(gain: Any, e: float, v: float, pull: Any, N: Any, b: Any) -> None:
    """Take the adjoint, of covariance N, back over a measurement of the first state that found it off by e, of variance
    v, and moved the states by `gain` (s,) of that; b (s,) : room.
    """
    along, twice = e / v, 1.0 / v
    for i in range(gain.shape[0]):
        b[i] = 0.0
        for j in range(gain.shape[0]):
            b[i] += N[i, j] * gain[j]
        along -= gain[i] * pull[i]
        twice += gain[i] * b[i]
    pull[0] += along
    for i in range(gain.shape[0]):
        N[0, i] -= b[i]
        N[i, 0] -= b[i]
    N[0, 0] += twice


@numba.njit(
    number(vector, vector, vector, number, vector, matrix, vector, vector), error_model="numpy", nogil=True, cache=True
)
def smoothed_force(t: Any, u: Any, q: Any, r: float, start: Any, mean: Any, variance: Any, jumps: Any) -> float:
    """Smooth u (n,), noise variance r, as so many integrals of white noise of intensities q (n - 1,). It starts at
    about `start` (order,): the force and its derivatives per sample.

    Fills mean (n, order) : the force and its derivatives, variance (n,) of the force, and jumps (n - 1,), the expected
    squares of the last derivative's steps; returns the log-likelihood of all but the first samples, but for a constant.
    The way back is that of Bryson and Frazier; steps as by Koopman (Biometrika 80(1), 1993).
    """
    n, s = mean.shape
    unit = (t[n - 1] - t[0]) / (n - 1)
    A, P, K, e, v = np.zeros((n, s)), np.zeros((n, s, s)), np.zeros((n, s)), np.empty(n), np.empty(n)
    F, Q, T, N, still = np.zeros((s, s)), np.zeros((s, s)), np.zeros((s, s)), np.zeros((s, s)), np.zeros((s, s))
    a, p, pull, b, first, rest = np.zeros(s), 1e4 * r * np.eye(s), np.zeros(s), np.zeros(s), np.zeros(s), np.zeros(s)
    fixed = np.zeros((s, 0))  # no parameters
    a[:], first[0], likelihood = start, 1.0, 0.0
    for k in range(n):
        A[k], P[k], e[k] = a, p, u[k] - a[0]
        v[k] = update(a, p, fixed, first, fixed[0], e[k], r, K[k])
        if k >= DIFFUSE:
            likelihood -= 0.5 * (np.log(v[k]) + e[k] ** 2 / v[k])
        if k + 1 < n:
            chained(t[k + 1] - t[k], q[k], unit, F, Q)
            predict(a, p, fixed, F, fixed, rest, Q, b, T, fixed)
    for k in range(n - 1, -1, -1):
        if k + 1 < n:
            chained(t[k + 1] - t[k], q[k], unit, F, Q)
            shift, own = conditioned(Q[s - 1], Q[s - 1, s - 1], pull, N)
            jumps[k] = max(shift**2 + own, 0.0) / unit ** (2 * s - 2)
            predict(pull, N, fixed, F.T, fixed, rest, still, b, T, fixed)
        back_over(K[k], e[k], v[k], pull, N, b)
        _, variance[k] = conditioned(P[k, 0], P[k, 0, 0], pull, N)
        for i in range(s):
            mean[k, i] = A[k, i]
            for j in range(s):
                mean[k, i] += P[k, i, j] * pull[j]
            mean[k, i] /= unit**i
    return likelihood
