"""The Kalman filter and smoother along a path, with derivatives by the parameters, compiled by numba.

What stands below the mark is compiled from its text (`linearised_model.loops`), after the steps of a filter in
`data/recursions.py`. Nothing imports this file but the tests: an import compiles it once more.

Shapes: n samples, s states, m free parameters. The last two states are the force u [N] and its slope du [N/s]. All
means are deviations from the path about which the model was linearised.
"""

# mypy: disallow_untyped_decorators=False
from __future__ import annotations

from typing import Any

import numba
import numpy as np

from identification.data.recursions import cube, matrix, native, predict, update, vector

# The recursions

RUNAWAY = 0.3
"""Standard deviation [m/s] beyond which a velocity is held to that of the path: no valve moves as fast."""


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
    numba.void(matrix, cube, cube, matrix, matrix, cube, cube, cube, cube, vector, matrix, matrix),
    error_model="numpy", nogil=True, cache=True,
)  # fmt: skip
def smoothed(A: Any, P: Any, S: Any, E: Any, V: Any, J: Any, K: Any, H: Any, F: Any, move: Any, out: Any,
             adjoints: Any) -> None:  # fmt: skip
    """Fixed-interval smoothing (modified Bryson-Frazier) with the parameters moved by `move` (m,); fills out (n, s),
    and adjoints (n, s): the gradient of half the sum of squares by the predicted state.
    """
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
            adjoints[k, i] = adjoint[i]
            out[k, i] = A[k, i]
            for j in range(m):
                out[k, i] += S[k, i, j] * move[j]
            for j in range(s):
                out[k, i] -= P[k, i, j] * adjoint[j]
