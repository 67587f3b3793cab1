"""The recursions over samples that a smoother needs, compiled by numba, for `linearised_model.py` and `force.py`.

This file is compiled from its text (`simulator.native_module`), so it imports nothing of ours.

Shapes: n samples, s states, m free parameters. The last two states are the force u [N] and its slope du [N/s]. All
means are deviations from the path about which the model was linearised.
"""

# mypy: disallow_untyped_decorators=False
from __future__ import annotations

from typing import Any

import numba
import numpy as np

native = numba.njit(error_model="numpy", nogil=True)
number, vector, matrix, cube = numba.float64, numba.float64[::1], numba.float64[:, ::1], numba.float64[:, :, ::1]

DIFFUSE = 4
"""Samples that tell where a chain of integrals starts, which is not known."""
RUNAWAY = 0.3
"""Standard deviation [m/s] beyond which a velocity is held to that of the path: no valve moves as fast."""


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


@numba.njit(
    numba.void(matrix, cube, cube, cube, cube, matrix, cube, matrix, matrix, cube, cube, matrix, cube, cube),
    error_model="numpy", nogil=True, cache=True,
)  # fmt: skip
def filtered(E: Any, H: Any, D: Any, F: Any, G: Any, jump: Any, Q: Any, R: Any, A: Any, P: Any, S: Any, V: Any,
             J: Any, K: Any) -> None:  # fmt: skip
    """The affine Kalman filter with parameter sensitivities, from A[0], P[0] and S[0].

    E (n, 3) : position and force less those of the path, in place turned into innovations; H (n, 2, s), D (n, 2, m) :
    their derivatives; F (n - 1, s, s), G (n - 1, s, m), jump (n - 1, s), Q (n - 1, s, s) : of the intervals; R (n, 2) :
    noise variances, inf where nothing was measured. Filled: A (n, s), P (n, s, s), S (n, s, m) before the measurements
    of a sample; V (n, 3) variances, J (n, 3, m) minus the derivatives and K (n, 3, s) gains of the innovations.

    The third innovation is none: where the velocity would be less known than by `RUNAWAY` it is taken as that of the
    path, give or take so much. In a play the position says nothing of the stem, and one that just breaks away is then
    unstable to first order, though not really.
    """
    n, s = A.shape
    m = S.shape[2]
    a, p, t = A[0].copy(), P[0].copy(), S[0].copy()
    T, U, b = np.empty((s, s)), np.empty((s, m)), np.empty(s)
    still = np.zeros(s)
    still[1] = 1.0
    for k in range(n):
        A[k], P[k], S[k] = a, p, t
        for c in range(2):
            for i in range(s):
                E[k, c] -= H[k, c, i] * a[i]
            for j in range(m):
                J[k, c, j] = D[k, c, j]
                for i in range(s):
                    J[k, c, j] += H[k, c, i] * t[i, j]
            if R[k, c] == np.inf:
                E[k, c], V[k, c], K[k, c] = 0.0, np.inf, 0.0
                J[k, c] = 0.0
            else:
                V[k, c] = update(a, p, t, H[k, c], J[k, c], E[k, c], R[k, c], K[k, c])
        if p[1, 1] > RUNAWAY**2:
            E[k, 2], J[k, 2] = -a[1], t[1]
            V[k, 2] = update(a, p, t, still, J[k, 2], E[k, 2], RUNAWAY**2, K[k, 2])
        else:
            E[k, 2], V[k, 2], J[k, 2], K[k, 2] = 0.0, np.inf, 0.0, 0.0
        if k + 1 < n:
            predict(a, p, t, F[k], G[k], jump[k], Q[k], b, T, U)


@native
def pull(e: float, v: float, J: Any, K: Any, move: Any, adjoint: Any) -> float:
    """How strongly an innovation e of variance v pulls at the adjoint (s,) along its row, parameters moved (m,)."""
    for j in range(move.shape[0]):
        e -= J[j] * move[j]
    strength = -e / v
    for i in range(adjoint.shape[0]):
        strength -= K[i] * adjoint[i]
    return strength


@numba.njit(
    numba.void(matrix, cube, cube, matrix, matrix, cube, cube, cube, cube, vector, matrix),
    error_model="numpy", nogil=True, cache=True,
)  # fmt: skip
def smoothed(A: Any, P: Any, S: Any, E: Any, V: Any, J: Any, K: Any, H: Any, F: Any, move: Any, out: Any) -> None:
    """Fixed-interval smoothing (modified Bryson-Frazier) with the parameters moved by `move` (m,); fills out (n, s)."""
    n, s = A.shape
    m = move.shape[0]
    adjoint, before = np.zeros(s), np.zeros(s)
    for k in range(n - 1, -1, -1):
        if k + 1 < n:
            for i in range(s):
                before[i] = 0.0
                for j in range(s):
                    before[i] += F[k, j, i] * adjoint[j]
            adjoint[:] = before
        for c in (2, 1, 0):
            if V[k, c] == np.inf:
                continue
            strength = pull(E[k, c], V[k, c], J[k, c], K[k, c], move, adjoint)
            if c == 2:
                adjoint[1] += strength
                continue
            for i in range(s):
                adjoint[i] += H[k, c, i] * strength
        for i in range(s):
            out[k, i] = A[k, i]
            for j in range(m):
                out[k, i] += S[k, i, j] * move[j]
            for j in range(s):
                out[k, i] -= P[k, i, j] * adjoint[j]


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
def given(row: Any, own: float, pull: Any, N: Any) -> tuple[float, float]:
    """Shift of the mean and variance of a quantity when all data are known, from its variance `own` and its covariance
    `row` (s,) with the states that the adjoint `pull` (s,), of covariance N, is of."""
    shift, variance = 0.0, own
    for i in range(row.shape[0]):
        shift += row[i] * pull[i]
        for j in range(row.shape[0]):
            variance -= row[i] * N[i, j] * row[j]
    return shift, variance


@native
def behind(gain: Any, e: float, v: float, pull: Any, N: Any, b: Any) -> None:
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


@numba.njit(number(vector, vector, vector, number, matrix, vector, vector), error_model="numpy", nogil=True, cache=True)
def smoothed_force(t: Any, u: Any, q: Any, r: float, mean: Any, variance: Any, jumps: Any) -> float:
    """Smooth u (n,), noise variance r, as so many integrals of white noise of intensities q (n - 1,).

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
    a[0], first[0], likelihood = u[0], 1.0, 0.0
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
            shift, own = given(Q[s - 1], Q[s - 1, s - 1], pull, N)
            jumps[k] = max(shift**2 + own, 0.0) / unit ** (2 * s - 2)
            predict(pull, N, fixed, F.T, fixed, rest, still, b, T, fixed)
        behind(K[k], e[k], v[k], pull, N, b)
        _, variance[k] = given(P[k, 0], P[k, 0, 0], pull, N)
        for i in range(s):
            mean[k, i] = A[k, i]
            for j in range(s):
                mean[k, i] += P[k, i, j] * pull[j]
            mean[k, i] /= unit**i
    return likelihood
