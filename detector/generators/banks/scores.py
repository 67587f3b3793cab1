"""The idea of the benchmark's bank without its name plate: everything is learned from data of one valve.

A parallel model of the positioner, learned; the flow relation, learned; the signals against their usual range. Each
residual is correlated over several memories with what small changes of the learned model's constants would do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from detector.generators.banks.parallel_lag import ParallelLag, learn_parallel_lag
from detector.generators.contract import Generator
from detector.generators.flow import Flow, learn_flow
from recordings import Array, BadInput

MEMORIES = (2.0, 10.0, 60.0, 600.0, 7200.0)
"""Readings over which scores are taken."""
LOUDEST = 10.0
"""A residual counts as this many deviations at most."""
_SETTLE = 100
_FLOOR = 0.02
_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class ScoreBank(Generator):
    """Scores of every residual over every memory, of unit spread without a fault, then over each memory all together.

    Inputs: CV [1], P1 and P2 [any unit, one for both]; outputs: X [1], F [any unit]. drop, full : means of P1 - P2 and
    largest F that was seen; usual (2, 2) : means and deviations of P1, P2; bias, power (n_scores,); spread (n_memories,
    n_scores); whitener (n_memories, n_scores, n_scores). The state holds sums only, so it can be stored and taken up.
    """

    lag: ParallelLag
    flow: Flow
    drop: float
    full: float
    usual: Array
    bias: Array
    power: Array
    spread: Array
    whitener: Array

    @property
    def width(self) -> tuple[int, int, int]:
        """Three inputs, two outputs."""
        n = len(self.bias)
        return 3, 2, len(MEMORIES) * (n + 1)

    def initial(self) -> Array:
        """No sums yet."""
        return np.concatenate([self.lag.initial(), np.zeros(1 + 2 * len(MEMORIES) * len(self.bias))])

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        n, seen = len(self.lag.initial()), int(state[len(self.lag.initial())])
        after, residuals, regressors = self.parts(state[:n], u, y)
        residuals = residuals - self.bias * regressors
        residuals[: max(_SETTLE - seen, 0)] = 0.0
        sums, raw = self._scores(state[n + 1 :], residuals, regressors)
        scores = raw / self.spread
        together = np.sqrt(np.mean(np.einsum("kms,mst->kmt", scores, self.whitener) ** 2, axis=2))
        return np.concatenate([after, [seen + len(u)], sums]), np.hstack([scores.reshape(len(u), -1), together])

    def parts(self, state: Array, u: Array, y: Array) -> tuple[Array, Array, Array]:
        """The lag's state, and residual and regressor behind every score, each (n, n_scores)."""
        drop, f = ((u[:, 1] - u[:, 2]) / self.drop), y[:, 1] / self.full
        after, r_x, answers = self.lag.answers(state, np.column_stack([u[:, 0], drop]), y[:, 0])
        flow, slope = self.flow.expected(drop, y[:, 0])
        r_f = (f - np.minimum(flow, 1.0)) / self.flow.deviation(drop, y[:, 0])
        loud_x, loud_f = (np.clip(r, -3 * LOUDEST, 3 * LOUDEST) for r in (r_x, r_f))
        one, open_, over = np.ones(len(u)), flow < 1.0, 1.0 / self.flow.deviation(drop, y[:, 0])
        ways = [one, open_ * flow * over, open_ * np.sqrt(np.maximum(drop, 0)) * over, open_ * slope * y[:, 0] * over]
        signals = np.clip((u[:, 1:] - self.usual[0]) / self.usual[1], -LOUDEST, LOUDEST)
        r_x, r_f = (np.clip(r, -LOUDEST, LOUDEST) for r in (loud_x, loud_f))
        found = np.column_stack([*[r_x] * answers.shape[1], loud_x**2, *[r_f] * 4, loud_f**2, signals])
        return after, np.nan_to_num(found), np.nan_to_num(np.column_stack([answers, one, *ways, one, one, one]))

    def _scores(self, sums: Array, residuals: Array, regressors: Array) -> tuple[Array, Array]:
        """New sums, and scores (n, n_memories, n_scores): sum r s / sqrt(sum s^2), a tenth of the usual added to it."""
        from scipy.signal import lfilter

        kept = sums.reshape(2, len(MEMORIES), -1)
        found = np.empty((len(residuals), len(MEMORIES), residuals.shape[1]))
        after = np.empty_like(kept)
        for i, memory in enumerate(MEMORIES):
            a = np.exp(-1.0 / memory)
            scored = lfilter([1.0], [1.0, -a], residuals * regressors, axis=0, zi=a * kept[0, [i]])[0]
            power = lfilter([1.0], [1.0, -a], regressors**2, axis=0, zi=a * kept[1, [i]])[0]
            after[0, i], after[1, i] = scored[-1], power[-1]
            found[:, i] = scored / np.sqrt(power + memory * _SHARE * self.power + 1e-12)
        return after.ravel(), found


def learn_score_bank(u: Array, y: Array) -> ScoreBank:
    """From fault-free rows u (n, 3), y (n, 2) as `ScoreBank` has them, a reading a second.

    The relations from the first third, bias and spread of their residuals from all. Raises BadInput for too few rows.
    """
    if len(u) < 3000:
        raise BadInput("score bank", f"{len(u)} readings", "give 3000 at least")
    third = slice(_SETTLE, _SETTLE + max(len(u) // 3, 2000))
    mean_drop, full = float(np.mean(u[third, 1] - u[third, 2])), float(np.max(y[third, 1]))
    drop = (u[:, 1] - u[:, 2]) / mean_drop
    lag = learn_parallel_lag(np.column_stack([u[third, 0], drop[third]]), y[third, 0])
    flow = learn_flow(drop[third], y[third, 0], y[third, 1] / full)
    usual = np.array([u[third, 1:].mean(axis=0), u[third, 1:].std(axis=0) + 1e-9])
    n = lag.constants_count + 8
    shape = (len(MEMORIES), n)
    blank = ScoreBank(
        lag, flow, mean_drop, full, usual, np.zeros(n), np.ones(n), np.ones(shape), np.stack([np.eye(n)] * shape[0])
    )
    _, residuals, regressors = (part[_SETTLE:] if part.ndim == 2 else part for part in blank.parts(lag.initial(), u, y))
    power = np.mean(regressors**2, axis=0)
    centred = replace(blank, bias=np.mean(residuals * regressors, axis=0) / (power + 1e-12), power=power)
    raw = centred.run(centred.initial(), u, y)[1][_SETTLE:, : shape[0] * n].reshape(-1, *shape)
    spread = np.sqrt(np.mean(raw**2, axis=0)) + 1e-9
    return replace(centred, spread=spread, whitener=np.stack([_whitener(z) for z in np.moveaxis(raw / spread, 1, 0)]))


def _whitener(scores: Array) -> Array:
    values, vectors = np.linalg.eigh(scores.T @ scores / len(scores))
    return np.asarray(vectors / np.sqrt(np.maximum(values, _FLOOR)), np.float64)
