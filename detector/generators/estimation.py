"""Recursive parameter estimation: constants of a model, estimated as readings come in, against their usual values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.arithmetic.native import native
from detector.generators.contract import Generator
from recordings import Array, BadInput


@dataclass(frozen=True, eq=False)
class Estimation(Generator):
    """(theta - usual) / spread, theta by recursive least squares with forgetting from y = u theta.

    Inputs: the regressors (p); output: y. memory : readings over which it forgets; usual, spread (p,) : of the
    estimates without a fault; cover (p, p) : their covariance at the start, over the variance of y; it starts anew
    from there when it has grown fourfold.
    """

    memory: float
    usual: Array
    spread: Array
    cover: Array

    @property
    def width(self) -> tuple[int, int, int]:
        """As many residuals as parameters."""
        return len(self.usual), 1, len(self.usual)

    def initial(self) -> Array:
        """The usual values, and how sure they are."""
        return np.concatenate([self.usual, self.cover.ravel()])

    def estimates(self, residuals: Array) -> Array:
        """The parameters (n, p) behind residuals."""
        return self.usual + residuals * self.spread

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        p = len(self.usual)
        theta, cover = state[:p].copy(), state[p:].reshape(p, p).copy()
        past, regressors, outputs = np.empty((len(u), p)), np.ascontiguousarray(u), np.ascontiguousarray(y[:, 0])
        _recursion(theta, cover, 1 - 1 / self.memory, self.cover, regressors, outputs, past)
        return np.concatenate([theta, cover.ravel()]), (past - self.usual) / self.spread


def learn_estimation(regressors: Array, y: Array, memory: float) -> Estimation:
    """Usual values by least squares on fault-free rows (n, p), (n,), and how estimates spread around them.

    Raises BadInput when there are too few rows or the regressors depend on each other.
    """
    n, p = regressors.shape
    if n < 10 * p or np.linalg.matrix_rank(regressors) < p:
        found = f"{n} rows of {p} regressors of rank {np.linalg.matrix_rank(regressors)}"
        raise BadInput("parameter estimation", found, "give more rows, or regressors that do not depend on each other")
    usual = np.asarray(np.linalg.lstsq(regressors, y, rcond=None)[0], np.float64)
    cover = np.linalg.inv(regressors.T @ regressors) * n / memory
    blank = Estimation(memory, usual, np.ones(p), cover)
    spread = np.std(blank.run(blank.initial(), regressors, y[:, None])[1][n // 5 :], axis=0)
    return Estimation(memory, usual, np.maximum(spread, 1e-12), cover)


@native
def _recursion(theta: Array, cover: Array, keep: float, first: Array, u: Array, y: Array, past: Array) -> None:
    """Recursive least squares over rows, changing theta and cover in place; past (n, p) : theta after each row.

    Forgetting lets the covariance grow where nothing is excited and lose its shape to rounding: it starts anew from
    `first` when it has grown fourfold, or is no covariance any more.
    """
    p, most = theta.shape[0], 4.0 * np.trace(first)
    pu = np.empty(p)
    for k in range(u.shape[0]):
        scale, miss = keep, y[k]
        for i in range(p):
            pu[i] = 0.0
            for j in range(p):
                pu[i] += cover[i, j] * u[k, j]
            miss -= u[k, i] * theta[i]
        for i in range(p):
            scale += u[k, i] * pu[i]
        sound, total = scale >= keep, 0.0
        for i in range(p):
            theta[i] += pu[i] / scale * miss if sound else 0.0
            past[k, i] = theta[i]
            for j in range(i, p):
                cover[i, j] = (cover[i, j] - pu[i] * pu[j] / scale) / keep
                cover[j, i] = cover[i, j]
            total += cover[i, i]
            sound = sound and cover[i, i] > 0.0
        if not sound or total > most:
            cover[:] = first
