"""A Markov chain through the posterior: blocks of unknowns by random walks that learn their steps.

Adaptive Metropolis (Haario, Saksman, Tamminen 2001) while it warms up, a fixed walk afterwards. A slip comes a sample
sooner or later at once, so the density has jumps, and derivatives do not help.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.loops.joint.series import JointSeries
from recordings import Array

INNER = 8
"""Moves of process and noise, which cost little, for one of the valve, which costs a simulation."""


@dataclass(frozen=True)
class Place:
    """Where a chain is. valve (5,); process (3,); delay [samples]; path (n,) of the stem; density : its logarithm."""

    valve: Array
    process: Array
    delay: int
    path: Array
    density: float


class _Walk:
    """A random walk of one block: its steps have the shape of what it has seen."""

    def __init__(self, first: Array, scale: Array) -> None:
        self._mean, self._cov, self._seen, self.size = first.copy(), np.diag(scale**2), 20.0, 1.0

    def move(self, rng: np.random.Generator) -> Array:
        """A step (n,); one in four changes a single unknown."""
        n = len(self._mean)
        if rng.uniform() < 0.25:
            i = int(rng.integers(n))
            step = np.zeros(n)
            step[i] = self.size * 2.4 * np.sqrt(self._cov[i, i]) * rng.normal()
            return step
        root = np.linalg.cholesky(self._cov + 1e-12 * np.eye(n))
        return np.asarray(self.size * 2.4 / np.sqrt(n) * root @ rng.normal(size=n), float)

    def learn(self, at: Array, taken: bool) -> None:
        """Shape and size from where the chain is: a quarter of the moves shall be taken."""
        self._seen += 1
        share, off = 1 / self._seen, at - self._mean
        self._mean = self._mean + share * off
        self._cov = (1 - share) * (self._cov + share * np.outer(off, off))
        self.size *= float(np.exp((0.75 if taken else -0.25) * 2 / np.sqrt(self._seen)))


def chain(series: JointSeries, start: Place, moves: int, rng: np.random.Generator) -> list[Place]:
    """The places of a chain after a warm-up of as many moves of the valve."""
    now, found = start, []
    outer = _Walk(start.valve, np.array([0.02, 0.1, 0.5, 0.5, 0.5]))
    inner = _Walk(start.process, np.array([0.05, 0.1, 0.1]))
    for k in range(2 * moves):
        warm = k < moves
        for _ in range(INNER):
            then = _inner_move(series, now, inner, rng)
            taken = _accepted(then, now, rng)
            now = then if taken else now
            if warm:
                inner.learn(now.process, taken)
        valve = now.valve + outer.move(rng)
        path = series.path(valve)
        taken = False
        if path is not None:
            then = Place(valve, now.process, now.delay, path, series.density(path, now.process, now.delay))
            taken = _accepted(then, now, rng)
            now = then if taken else now
        if warm:
            outer.learn(now.valve, taken)
        else:
            found.append(now)
    return found


def _inner_move(series: JointSeries, now: Place, walk: _Walk, rng: np.random.Generator) -> Place:
    process, delay = now.process, now.delay
    if rng.uniform() < 0.3:
        delay += int(rng.choice((-1, 1)))
    else:
        process = process + walk.move(rng)
    return Place(now.valve, process, delay, now.path, series.density(now.path, process, delay))


def _accepted(then: Place, now: Place, rng: np.random.Generator) -> bool:
    return bool(np.log(rng.uniform()) < then.density - now.density)


def scale_reduction(chains: Array) -> float:
    """Largest R of unknowns from chains (m, n, k): above 1.1 they have not met (Gelman and Rubin 1992)."""
    n = chains.shape[1]
    within = chains.var(axis=1, ddof=1).mean(axis=0)
    between = chains.mean(axis=1).var(axis=0, ddof=1)
    return float(np.sqrt(np.max(((n - 1) / n * within + between) / np.maximum(within, 1e-12))))
