"""The recursions over samples that a smoother needs, compiled by numba, for `_linearised.py` and `_force.py`.

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


@numba.njit(number(vector, vector, vector, number, matrix, cube, vector), error_model="numpy", nogil=True, cache=True)
def smoothed_force(t: Any, u: Any, q: Any, r: float, mean: Any, P: Any, jumps: Any) -> float:
    """Smooth u (n,), noise variance r, as the integral of a slope driven by white noise of intensity q (n - 1,).

    Fills mean (n, 2), P (n, 2, 2) and jumps (n - 1,), the expected squares of the slope's steps; returns the
    log-likelihood but for a constant. Rauch, Tung and Striebel's form.
    """
    n = u.shape[0]
    ahead, Pa = np.zeros((n, 2)), np.zeros((n, 2, 2))
    ahead[0, 0] = u[0]
    Pa[0, 0, 0], Pa[0, 1, 1] = 1e4 * r, 1e4 * r / (t[1] - t[0]) ** 2
    likelihood = 0.0
    for k in range(n):
        if k:
            h, w = t[k] - t[k - 1], q[k - 1]
            A = P[k - 1]
            ahead[k, 0], ahead[k, 1] = mean[k - 1, 0] + h * mean[k - 1, 1], mean[k - 1, 1]
            Pa[k, 1, 1] = A[1, 1] + w * h
            Pa[k, 0, 1] = Pa[k, 1, 0] = A[0, 1] + h * A[1, 1] + w * h**2 / 2
            Pa[k, 0, 0] = A[0, 0] + 2 * h * A[0, 1] + h**2 * A[1, 1] + w * h**3 / 3
        variance, e = Pa[k, 0, 0] + r, u[k] - ahead[k, 0]
        if k > 1:
            likelihood -= 0.5 * (np.log(variance) + e**2 / variance)
        for i in range(2):
            mean[k, i] = ahead[k, i] + Pa[k, i, 0] / variance * e
            for j in range(2):
                P[k, i, j] = Pa[k, i, j] - Pa[k, i, 0] * Pa[k, 0, j] / variance
    for k in range(n - 2, -1, -1):
        h = t[k + 1] - t[k]
        B, L = Pa[k + 1], np.empty((2, 2))
        det = B[0, 0] * B[1, 1] - B[0, 1] ** 2
        for i in range(2):
            c0, c1 = P[k, i, 0] + h * P[k, i, 1], P[k, i, 1]
            L[i, 0], L[i, 1] = (c0 * B[1, 1] - c1 * B[0, 1]) / det, (c1 * B[0, 0] - c0 * B[0, 1]) / det
        off, spread = mean[k + 1] - ahead[k + 1], P[k + 1] - B
        mean[k] += L @ off
        P[k] += L @ spread @ L.T
        together = L[1, 0] * P[k + 1, 0, 1] + L[1, 1] * P[k + 1, 1, 1]
        step = mean[k + 1, 1] - mean[k, 1]
        jumps[k] = max(step**2 + P[k + 1, 1, 1] + P[k, 1, 1] - 2 * together, 0.0)
    return likelihood
