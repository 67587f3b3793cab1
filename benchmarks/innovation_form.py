"""The innovation form: a predictor whose corrections have constant gains, fitted by its one-step errors."""

# mypy: disallow_untyped_decorators=False
from __future__ import annotations

from dataclasses import replace
from typing import Any

import numba
import numpy as np

from identification.estimators import (
    AffineModel,
    Coordinates,
    Grid,
    Innovations,
    PathFreedom,
    first_variances,
    kalman_filter,
)
from recordings import Array
from simulator import Kernel

FAR = 1e3
"""One-step error [m] from which a predictor has run off."""


@numba.njit(error_model="numpy", nogil=True)
def predicted(E: Any, seen: Any, H: Any, D: Any, F: Any, G: Any, jump: Any, gain: Any, A: Any, S: Any, J: Any) -> None:
    """One-step errors of a predictor about a path, in place of E (n,), which holds measured less path.

    H (n, s), D (n, m), F (n - 1, s, s), G (n - 1, s, m), jump (n - 1, s): derivatives and defects of the path; gain
    (s,); filled are the corrected means A (n, s), their derivatives S (n, s, m), and those of the errors, J (n, m). The
    last two states, the force and its slope, are the path's.
    """
    n, s = A.shape
    a, t = np.zeros(s), np.zeros((s, G.shape[2]))
    for k in range(n):
        if k:
            a, t = F[k - 1] @ a + jump[k - 1], F[k - 1] @ t + G[k - 1]
            a[s - 2 :], t[s - 2 :] = 0.0, 0.0
        if seen[k]:
            E[k] -= H[k] @ a
            J[k] = -D[k] - H[k] @ t
            for i in range(s):
                a[i] += gain[i] * E[k]
                t[i] += gain[i] * J[k]
        A[k], S[k] = a, t


class InnovationForm:
    """A `Predictor`. The force is an input, as smoothed without a model. The gains of position, velocity and bristle
    are the medians of an extended Kalman filter's along the present path, which knows the noise of the force; the
    variance of the errors is their own."""

    def toward(self, line: Innovations, move: Array | None = None, share: float = 1.0) -> Array:
        """The way to the predictor's corrected means."""
        A, S = line.smoother
        return np.asarray(share * A if move is None else share * A + S @ move)

    def line(
        self, kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, freedom: PathFreedom
    ) -> Innovations | None:
        """The one-step errors along a path at parameters p; None where the predictor runs off."""
        model = AffineModel.of(kernel, coordinates, grid, p, path, freedom.h_max)
        if model is None:
            return None
        first = first_variances(kernel, grid, p, freedom, path)
        kalman = kalman_filter(kernel, grid, p, replace(freedom, curvature=0.0), model.without_parameters(), first)
        if kalman is None:
            return None
        seen = np.isfinite(model.E[:, 0])
        gain = np.median(kalman.smoother[6][seen, 0], axis=0)
        gain[-2:] = 0.0
        (n, m), s = model.D[:, 0].shape, path.shape[1]
        E, A, S, J = np.nan_to_num(model.E[:, 0]), np.empty((n, s)), np.empty((n, s, m)), np.zeros((n, m))
        H, D = (np.ascontiguousarray(part[:, 0]) for part in (model.H, model.D))
        predicted(E, seen, H, D, model.F, model.G, model.jump, gain, A, S, J)
        if not (np.abs(E) < FAR).all() or not np.isfinite(J).all():
            return None
        none = np.zeros(n)
        errors = np.column_stack([E, none])
        variances = np.column_stack([np.where(seen, np.mean(E[seen] ** 2), np.inf), none + np.inf])
        return Innovations(errors, variances, np.stack([J, np.zeros((n, m))], axis=1), (errors, variances), (A, S))
