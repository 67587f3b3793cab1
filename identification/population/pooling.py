"""Estimates of valves of one type pooled by a hierarchical model, where that narrows their intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from recordings import Array

LEAST = 3
"""With fewer valves of a type nothing is learned of how they differ."""

GRID = 400
"""Places of the spread between valves at which its posterior is computed."""


@dataclass(frozen=True)
class Pooled:
    """What the valves of a type say of each of n valves, and of the next one.

    mean, std, lower, upper : of each valve, with the ends of its interval, shape (n,) each; middle, spread : posterior
    means of the type's mean and of the standard deviation between valves; new_mean, new_std : of a valve of the type
    that was not measured: a prior for its fit.
    """

    mean: Array
    std: Array
    lower: Array
    upper: Array
    middle: float
    spread: float
    new_mean: float
    new_std: float


def pooled(values: Array, errors: Array, level: float = 0.9) -> Pooled | None:
    """Pool the estimates of one quantity over the valves of one type; None with fewer than three.

    Parameters
    ----------
    values, errors : array, shape (n,)
        Estimates and their standard errors, on a scale where both are about normal.
    level : float, optional
        Of the intervals.

    Notes
    -----
    The normal hierarchical model: the estimate of valve i is normal around its true value with the known error, and the
    true values are normal around the type's mean. Mean and spread have flat priors; the spread is integrated over a
    grid and all else in closed form (Gelman et al., Bayesian Data Analysis, 3rd ed., section 5.4, equations 5.17 to
    5.21). So the intervals know that the spread is not known.
    """
    if len(values) < LEAST or not (np.all(np.isfinite(values)) and np.all(errors > 0)):
        return None
    tau = _grid(values, errors)
    total = errors**2 + tau[:, None] ** 2  # (grid, n)
    precision = (1.0 / total).sum(axis=1)
    mu = (values / total).sum(axis=1) / precision
    log_density = (
        -0.5 * np.log(precision) - 0.5 * np.log(total).sum(axis=1) - 0.5 * ((values - mu[:, None]) ** 2 / total).sum(1)
    )
    weights = np.exp(log_density - log_density.max()) * np.gradient(tau)
    weights /= weights.sum()
    shrunk = tau[:, None] ** 2 / total
    means = mu[:, None] + shrunk * (values - mu[:, None])
    variances = shrunk * errors**2 + (1.0 - shrunk) ** 2 / precision[:, None]
    mean = weights @ means
    std = np.sqrt(weights @ (variances + means**2) - mean**2)
    ends = [_quantiles(means, np.sqrt(variances), weights, share) for share in ((1 - level) / 2, (1 + level) / 2)]
    new_mean = float(weights @ mu)
    new_variance = float(weights @ (tau**2 + 1.0 / precision + mu**2)) - new_mean**2
    return Pooled(mean, std, ends[0], ends[1], new_mean, float(weights @ tau), new_mean, float(np.sqrt(new_variance)))


def _grid(values: Array, errors: Array) -> Array:
    """Spreads from almost none to far more than is seen, dense where they are small: shape (GRID,)."""
    most = 5.0 * float(np.std(values)) + 3.0 * float(np.median(errors))
    grid: Array = most * np.linspace(0.0, 1.0, GRID) ** 2 + 1e-9 * most
    return grid


def _quantiles(means: Array, stds: Array, weights: Array, share: float) -> Array:
    """Quantile of each valve's mixture of normal distributions, shape (n,)."""
    found = np.empty(means.shape[1])
    for valve in range(means.shape[1]):
        m, s = means[:, valve], stds[:, valve]
        below, above = float((m - 9 * s).min()), float((m + 9 * s).max())

        def excess(x: float, m: Array = m, s: Array = s) -> float:
            return float(weights @ stats.norm.cdf((x - m) / s)) - share

        found[valve] = optimize.brentq(excess, below, above, xtol=1e-12 * max(abs(below), abs(above), 1e-300))
    return found
