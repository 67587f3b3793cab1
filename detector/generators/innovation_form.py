"""A linear plant with its noise, learned from readings: a vector ARX model as an innovation form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from detector.generators.contract import windows
from detector.generators.plant import LinearPlant
from recordings import Array, BadInput

DEPTHS = (2, 4, 8, 12, 20, 30)
"""Numbers of past readings that are tried."""


@dataclass(frozen=True, eq=False)
class InnovationForm:
    """x(k+1) = A x + B u + K e, y = C x + D u + e, e white of covariance R (m, m); K (n, m).

    A Kalman filter for it has process noise K e, measurement noise e and, because they are the same e, the
    cross-covariance K R. means : of inputs (r,) and outputs (m,), which are taken off before. Faults of the plant:
    a constant on each output, then one on each input.
    """

    plant: LinearPlant
    K: Array
    R: Array
    means: tuple[Array, Array]

    @property
    def covariances(self) -> tuple[Array, Array, Array]:
        """Q (n, n), R (m, m) and S (n, m), as `settled` takes them."""
        return self.K @ self.R @ self.K.T, self.R, self.K @ self.R


def learn_innovation_form(u: Array, y: Array, depths: Sequence[int] = DEPTHS) -> InnovationForm:
    """Least squares on fault-free rows u (n, r), y (n, m); of the depths, the one with the least Schwarz criterion.

    Any stationary innovation form is the limit of such models, so a depth that suffices leaves white innovations.
    Raises BadInput when there are hardly more rows than coefficients.
    """
    most = max(depths)
    wanted = 5 * ((most + 1) * (u.shape[1] + y.shape[1]))
    if len(y) - most < wanted:
        raise BadInput("innovation form", f"{len(y)} readings", f"give at least {wanted + most}")
    means = (np.asarray(u.mean(axis=0)), np.asarray(y.mean(axis=0)))
    one, other = u - means[0], y - means[1]
    fits = [_fit(one[most - depth :], other[most - depth :], depth) for depth in depths]
    coefficients, R, depth = min(fits, key=lambda fit: _schwarz(fit, len(y) - most))
    plant, K = observer_form(coefficients, depth, u.shape[1], y.shape[1])
    return InnovationForm(plant, K, R, means)


def regressors(u: Array, y: Array, depth: int) -> Array:
    """Rows of a vector ARX model: outputs of lags 1 to depth, then inputs of lags 0 to depth, for readings from the
    depth-th on, (n - depth, depth m + (depth + 1) r).
    """
    past, m = windows(np.hstack([y, u]), depth)[:, ::-1], y.shape[1]
    return np.hstack([past[:, 1:, :m].reshape(len(past), -1), past[:, :, m:].reshape(len(past), -1)])


def _fit(u: Array, y: Array, depth: int) -> tuple[Array, Array, int]:
    rows = regressors(u, y, depth)
    solved = np.asarray(np.linalg.lstsq(rows, y[depth:], rcond=None)[0], np.float64)
    error = y[depth:] - rows @ solved
    return solved, np.atleast_2d(np.cov(error.T)) + 1e-15 * np.eye(y.shape[1]), depth


def _schwarz(fit: tuple[Array, Array, int], n: int) -> float:
    coefficients, R, _ = fit
    return float(n * np.linalg.slogdet(R)[1] + np.log(n) * coefficients.size)


def observer_form(coefficients: Array, depth: int, r: int, m: int) -> tuple[LinearPlant, Array]:
    """From coefficients of `regressors` (n_regressors, m): y(k) = x1(k) + B0 u(k) + e(k),
    x_i(k+1) = x_(i+1)(k) + A_i y(k) + B_i u(k): the plant and K = (A_1 ... A_d).
    """
    K = np.vstack([coefficients[i * m : (i + 1) * m].T for i in range(depth)])
    inputs = [coefficients[depth * m + i * r : depth * m + (i + 1) * r].T for i in range(depth + 1)]
    A = np.eye(depth * m, k=m)
    A[:, :m] += K
    C = np.hstack([np.eye(m), np.zeros((m, (depth - 1) * m))])
    B, D = np.vstack(inputs[1:]) + K @ inputs[0], inputs[0]
    R1, R2 = np.hstack([np.zeros((depth * m, m)), B]), np.hstack([np.eye(m), D])
    return LinearPlant(A, B, C, D, R1, R2), K
