"""A quantity over the years: its level and its trend, updated recording by recording.

Level and slope are the state of a Kalman filter (a local linear trend: Harvey, Forecasting, Structural Time Series
Models and the Kalman Filter, 1989, chapter 2). How much the level wanders and how much recordings scatter beyond their
own intervals is not known: filters run for a grid of both, weighted by how well they foretold every recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from recordings import Array

WANDER = (0.0, 3e-4, 1e-3, 3e-3, 1e-2)
"""Wander of the level in a day, share of the first value."""
SCATTER = (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
"""Scatter of recordings beyond their intervals, share of the first value."""
STEEPEST = 0.03
"""What is known of the slope beforehand: standard deviation in a day, share of the first value."""
INTERVAL = (0.025, 0.975)


@dataclass(frozen=True)
class TrendBelief:
    """What is believed of a quantity after so many recordings. Arrays over the grid of wander and scatter.

    scale : first value; day : of the last recording; mean (n_grid, 2), covariance (n_grid, 2, 2) : of level and slope
    (in a day); weight (n_grid,) : logarithms; wander, scatter (n_grid,) : standard deviations, in the unit of the
    quantity.
    """

    scale: float
    day: float
    mean: Array
    covariance: Array
    weight: Array
    wander: Array
    scatter: Array

    @classmethod
    def first(cls, day: float, value: float, std: float) -> TrendBelief:
        """The belief after a first recording."""
        scale = max(abs(value), std, 1e-12)
        wander, scatter = (grid.ravel() * scale for grid in np.meshgrid(WANDER, SCATTER))
        n = len(wander)
        covariance = np.zeros((n, 2, 2))
        covariance[:, 0, 0], covariance[:, 1, 1] = std**2 + scatter**2, (STEEPEST * scale) ** 2
        return cls(scale, day, np.tile([value, 0.0], (n, 1)), covariance, np.zeros(n), wander, scatter)

    def at(self, day: float) -> TrendBelief:
        """The belief for another day, not before the last one."""
        step = np.array([[1.0, day - self.day], [0.0, 1.0]])
        covariance = step @ self.covariance @ step.T
        covariance[:, 0, 0] += self.wander**2 * (day - self.day)
        return replace(self, day=day, mean=self.mean @ step.T, covariance=covariance)

    def seen(self, day: float, value: float, std: float) -> TrendBelief:
        """The belief after a further recording."""
        now = self.at(day)
        variance = now.covariance[:, 0, 0] + std**2 + self.scatter**2
        off = value - now.mean[:, 0]
        gain = now.covariance[:, :, 0] / variance[:, None]
        covariance = now.covariance - gain[:, :, None] * now.covariance[:, None, 0, :]
        weight = now.weight - 0.5 * (np.log(variance) + off**2 / variance)
        return replace(now, mean=now.mean + gain * off[:, None], covariance=covariance, weight=weight - weight.max())

    @property
    def share(self) -> Array:
        """Probability (n_grid,) of every wander and scatter."""
        odds = np.exp(self.weight)
        return np.asarray(odds / odds.sum(), float)

    def drawn(self, n: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
        """Levels, slopes and wanders (n,) drawn from the belief."""
        which = rng.choice(len(self.weight), n, p=self.share)
        roots = np.linalg.cholesky(self.covariance + 1e-18 * self.scale**2 * np.eye(2))
        found = self.mean[which] + np.einsum("kij,kj->ki", roots[which], rng.normal(size=(n, 2)))
        return found[:, 0], found[:, 1], self.wander[which]
