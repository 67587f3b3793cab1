"""Levenberg-Marquardt on normal equations, with a robust loss (Levenberg 1944, Marquardt 1963, Holland & Welsch 1977).

A Jacobian costs hardly more than a simulation here (forward sensitivities), and the unknowns are few: so every
evaluation returns the gradient and the Gauss-Newton matrix, and recordings are added up instead of stacked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from recordings import Array


@dataclass(frozen=True)
class Normal:
    """cost : sum of losses; gradient (n,) : J^T W r; matrix (n, n) : J^T W J; of normalised residuals r."""

    cost: float
    gradient: Array
    matrix: Array

    def with_prior(self, theta: Array, centre: Array, precision: Array) -> Normal:
        """Add a normal prior of independent coordinates.

        theta, centre (n,) : where it is evaluated and where it is highest, in one scale; precision (n,) : 1 / std^2.
        """
        off = theta - centre
        return Normal(
            self.cost + float(np.sum(precision * off**2)),
            self.gradient + precision * off,
            self.matrix + np.diag(precision),
        )


def weighted(r: Array, jacobian: Array, tuning: float) -> Normal:
    """Normal equations of residuals r (n_samples,) and jacobian (n_samples, n), Cauchy loss at `tuning` sigmas.

    An infinite tuning means plain squares.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isinf(tuning):
            return Normal(float(r @ r), jacobian.T @ r, jacobian.T @ jacobian)
        ratio = (r / tuning) ** 2
        heavy = jacobian / (1.0 + ratio)[:, None]
        return Normal(float(tuning**2 * np.sum(np.log1p(ratio))), heavy.T @ r, heavy.T @ jacobian)


def cauchy(r: Array, tuning: float) -> Array:
    """Cauchy's loss of each number r, normalised, of any shape; the answer has that shape.

    tuning : in standard deviations; infinite for squares.
    """
    return np.asarray(r**2 if np.isinf(tuning) else tuning**2 * np.log1p((r / tuning) ** 2), float)


@dataclass(frozen=True)
class Descent:
    """Where a descent ended: theta (n,), the normal equations there, evaluations used, and whether it settled."""

    theta: Array
    normal: Normal
    evaluations: int
    settled: bool


def descend(
    evaluate: Callable[[Array], Normal | None],
    theta: Array,
    *,
    iterations: int = 30,
    tolerance: float = 1e-4,
    longest: float = 1.0,
    damping: float = 1e-2,
) -> Descent | None:
    """Minimise by damped Gauss-Newton steps (Levenberg-Marquardt). None when the model diverges at the start itself.

    evaluate : the normal equations at (n,), None where the model diverges; theta (n,) : the start, coordinates in a
    scale of one each; longest : largest move of a coordinate per iteration; tolerance : relative decrease of the cost
    below which the descent has settled; damping : at the start, a share of the diagonal.
    """
    now = _sound(evaluate(theta))
    if now is None:
        return None
    used, settled = 1, False
    for _ in range(iterations):
        for _ in range(7):
            moved = theta + np.clip(move(now, damping), -longest, longest)
            trial = _sound(evaluate(moved))
            used += 1
            if trial is not None and trial.cost < now.cost:
                break
            damping = max(6 * damping, 1e-6)
        else:
            settled = True
            break
        gain = (now.cost - trial.cost) / max(now.cost, 1e-300)
        theta, now, damping = moved, trial, max(damping / 4, 1e-12)
        if gain < tolerance:
            settled = True
            break
    return Descent(theta, now, used, settled)


def _sound(normal: Normal | None) -> Normal | None:
    """None for normal equations that are not finite: sensitivities can overflow where the model itself does not."""
    if normal is None or not np.isfinite(normal.cost) or not np.isfinite(normal.matrix).all():
        return None
    return normal if np.isfinite(normal.gradient).all() else None


def move(normal: Normal, damping: float) -> Array:
    """The damped Gauss-Newton move (n,) of the coordinates; damping : a share of the diagonal of the matrix (n, n)."""
    diagonal = np.diag(normal.matrix)
    scale = np.sqrt(np.maximum(diagonal, 1e-12 * max(float(diagonal.max()), 1e-300)))
    scaled = normal.matrix / np.outer(scale, scale)
    scaled[np.diag_indices_from(scaled)] += damping
    move: Array = -np.linalg.lstsq(scaled, normal.gradient / scale, rcond=None)[0] / scale
    return move
