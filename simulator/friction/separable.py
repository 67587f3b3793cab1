"""Least squares of models that are linear but for a few shapes, by variable projection.

For given shapes the linear coefficients have a closed form, so only the shapes are searched for (Golub and Pereyra,
"The differentiation of pseudo-inverses and nonlinear least squares problems", SIAM J. Numer. Anal. 10, 1973).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from recordings import Array, BadInput, BadParameter

STARTS = 5
"""Starting values of each shape, spread evenly over the logarithm of its range."""


class Separable(NamedTuple):
    """linear (n_linear), shapes (n_shapes); std : of both, in this order; rmse; columns (n_samples, n_linear)."""

    linear: Array
    shapes: Array
    std: Array
    rmse: float
    columns: Array


def fit_separable(
    columns: Callable[..., Array],
    names: Sequence[str],
    ranges: Sequence[tuple[float, float]],
    x: ArrayLike,
    y: ArrayLike,
) -> Separable:
    """Coefficients of y = columns(x, *shapes) @ linear, x and y (n_samples).

    columns : (n_samples, n_linear) of x and the shapes; names : of the linear coefficients; ranges : least and largest
    value of each shape, both positive. Raises BadParameter for rows that differ, are not finite or too short, BadInput
    where the samples do not tell a coefficient.
    """
    at, seen = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    least = len(names) + len(ranges) + 1
    if at.shape != seen.shape or at.ndim != 1 or len(at) < least:
        raise BadParameter("force", seen.shape, f"beside {at.shape}", f"give equal rows of {least} samples or more")
    if not (np.isfinite(at).all() and np.isfinite(seen).all()):
        raise BadParameter("force", "", "a sample is not finite", "leave it out")
    logs = [np.linspace(np.log(low), np.log(high), STARTS + 2)[1:-1] for low, high in ranges]
    starts = np.array(np.meshgrid(*logs, indexing="ij")).reshape(len(ranges), -1).T if logs else np.zeros((1, 0))

    def off(p: Array) -> Array:
        C = columns(at, *np.exp(p))
        return C @ _solved(C, seen) - seen

    costs = [float(np.sum(off(start) ** 2)) for start in starts]
    best = starts[int(np.argmin(costs))]
    if len(ranges):
        low, high = np.log(np.array(ranges)).T
        scale = max(float(np.std(seen)), 1e-300)
        best = least_squares(lambda p: off(p) / scale, best, bounds=(low, high), xtol=1e-12, ftol=1e-14, gtol=1e-14).x
    C = columns(at, *np.exp(best))
    _check_told(C, names)
    linear, residual = _solved(C, seen), off(best)
    steps = [1e-5 * np.eye(len(best))[i] for i in range(len(best))]
    slopes = [(columns(at, *np.exp(best + s)) - columns(at, *np.exp(best - s))) @ linear / 2e-5 for s in steps]
    J = np.column_stack([C, *[slope / np.exp(p) for slope, p in zip(slopes, best, strict=True)]])
    variance = float(residual @ residual) / max(len(seen) - J.shape[1], 1)
    size = np.linalg.norm(J, axis=0)
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv((J / size).T @ (J / size))), 0.0)) / size
    return Separable(linear, np.exp(best), np.sqrt(variance) * spread, float(np.sqrt(np.mean(residual**2))), C)


def _solved(C: Array, y: Array) -> Array:
    size = np.maximum(np.linalg.norm(C, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(C / size, y, rcond=None)[0] / size)


def _check_told(C: Array, names: Sequence[str]) -> None:
    """Every column is there and is no combination of the others, or the samples do not tell its coefficient."""
    size = np.linalg.norm(C, axis=0)
    _, values, rows = np.linalg.svd(C / np.where(size > 0, size, 1.0), full_matrices=False)
    free = rows[values < 1e-9 * values[0]]
    if len(free):
        lost = [name for name, part in zip(names, np.abs(free).max(axis=0), strict=True) if part > 0.1]
        remedy = "give samples of both directions and of more speeds, or a map with fewer parameters"
        raise BadInput("velocity", f"the samples do not tell {', '.join(lost)}", remedy)
