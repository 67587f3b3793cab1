"""What the next step of a descent promises: which descents are worth going on with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.estimators.estimate import Estimate
from identification.estimators.least_squares import Normal
from identification.tracing import settings
from recordings import Array

SINGULAR = 1e-9
"""Relative singular value below which two parameters are taken for one."""


def newton_step(normal: Normal, chosen: NDArray[np.bool_] | None = None) -> tuple[Array, float]:
    """The Gauss-Newton step (m,) in the chosen coordinates, or in all, and the fall of the cost that it promises."""
    matrix, gradient = normal.matrix, normal.gradient
    chosen = np.ones(len(gradient), np.bool_) if chosen is None else chosen
    scale = np.sqrt(np.maximum(np.diag(matrix)[chosen], 1e-300))
    inner = matrix[np.ix_(chosen, chosen)] / np.outer(scale, scale)
    step = np.zeros(len(gradient))
    step[chosen] = -np.linalg.lstsq(inner, gradient[chosen] / scale, rcond=SINGULAR)[0] / scale
    return step, float(-gradient @ step)


def may_reach(now: Estimate, cost: float) -> bool:
    """Whether a descent may still come below a cost."""
    return now.cost - settings.PROMISE_FACTOR * newton_step(now.normal)[1] < cost
