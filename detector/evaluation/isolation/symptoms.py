"""Symptoms: everything the knowledge of the plant says about a run, each a number of unit spread without a fault.

Two learned relations (X against CV through the servo, F against X and pressures through the flow equation) and the
process signals themselves. Each relation's residual is correlated, over several memories, with what a small change of
each of its constants would do: the score of a recursive parameter estimation, one constant at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from detector.evaluation.benchmark.runs import CV, P1, P2, T1, F, X
from detector.generators.drive.servo import CHANGES, Servo, learn_servo
from detector.generators.flow import Flow, learn_flow
from recordings import Array

MEMORIES = (2.0, 10.0, 60.0, 600.0, 7200.0)
"""Time constants of the scores [s]."""

LOUDEST = 10.0
"""A residual counts as this many deviations at most: one wild reading must not outlast the memories."""

SCORES = (
    *(f"servo.{name}" for name in CHANGES), "servo.mean", "servo.power",
    "flow.mean", "flow.factor", "flow.bypass", "flow.scale", "flow.power", "inlet", "outlet", "temperature",
)  # fmt: skip
"""What is scored: constants of the servo, its mean and power; factor, additive part and sensor scale of the flow;
process signals against their usual range."""

NAMES = (*(f"{score}@{memory:g}s" for memory in MEMORIES for score in SCORES), *(f"all@{m:g}s" for m in MEMORIES))
"""Every score over every memory, and over each memory the length of all of them together."""

_SETTLE = 100
_THIN = 5
"""Every so many seconds a score is taken for the spread."""


@dataclass(frozen=True, eq=False)
class Symptoms:
    """servo, flow : learned; drop : mean of P1 - P2 [share]; usual : means and deviations (2, 3) of P1, P2, T1; bias
    (n_scores,) : of each residual along its regressor; power (n_scores,) : mean square of each regressor; spread : of
    the scores (n_memories, n_scores); whitener (n_memories, n_scores, n_scores) : makes the scores of a memory
    uncorrelated, so that a drift of the healthy plant itself counts for little.
    """

    servo: Servo
    flow: Flow
    drop: float
    usual: Array
    bias: Array
    power: Array
    spread: Array
    whitener: Array

    def of(self, run: Array) -> Array:
        """Symptoms of a run (n, 6), columns `SIGNALS`, shape (n, n_symptoms), columns `NAMES`."""
        scores = self.raw(run) / self.spread
        together = [
            np.sqrt(np.mean((z @ w) ** 2, axis=1))
            for z, w in zip(np.moveaxis(scores, 1, 0), self.whitener, strict=True)
        ]
        return np.column_stack([scores.reshape(len(run), -1), *together])

    def white(self, run: Array) -> Array:
        """Scores made uncorrelated within each memory (n, n_memories * n_scores)."""
        scores = self.raw(run) / self.spread
        return np.hstack([z @ w for z, w in zip(np.moveaxis(scores, 1, 0), self.whitener, strict=True)])

    def raw(self, run: Array) -> Array:
        """Scores before they are scaled (n, n_memories, n_scores)."""
        residuals, regressors = self.parts(run)
        residuals = residuals - self.bias * regressors
        residuals[:_SETTLE] = 0.0
        return np.stack([_scores(residuals, regressors, memory, self.power) for memory in MEMORIES], axis=1)

    def residuals(self, run: Array) -> tuple[Array, Array]:
        """The residuals of servo and flow (n,), each over its deviation."""
        r_x = self.servo.run(self.servo.initial(), _inputs(run), run[:, [X]])[1][:, 0] / self.servo.noise
        drop = (run[:, P1] - run[:, P2])[:, None] / self.drop
        r_f = self.flow.run(self.flow.initial(), drop, run[:, [X, F]])[1][:, 0]
        return r_x, r_f

    def parts(self, run: Array) -> tuple[Array, Array]:
        """Residual and regressor behind every score, each (n, n_scores)."""
        loud_x, loud_f = (np.clip(r, -3 * LOUDEST, 3 * LOUDEST) for r in self.residuals(run))
        r_x, r_f = (np.clip(r, -LOUDEST, LOUDEST) for r in (loud_x, loud_f))
        one, answers = np.ones(len(run)), self.servo.answers(_inputs(run), float(run[0, X])) / self.servo.noise
        drop = (run[:, P1] - run[:, P2]) / self.drop
        flow, slope = self.flow.expected(drop, run[:, X])
        open_, over = flow < 1.0, 1.0 / self.flow.deviation(drop, run[:, X])
        ways = [one, open_ * flow * over, open_ * np.sqrt(np.maximum(drop, 0)) * over, open_ * slope * run[:, X] * over]
        signals = np.clip((run[:, [P1, P2, T1]] - self.usual[0]) / self.usual[1], -LOUDEST, LOUDEST)
        residuals = [*[r_x] * (len(CHANGES) + 1), loud_x**2, *[r_f] * 4, loud_f**2, *signals.T]
        regressors = [*answers.T, one, one, *ways, one, one, one, one]
        found, by = np.column_stack(residuals), np.column_stack(regressors)
        return np.nan_to_num(found), np.nan_to_num(by)


def _scores(residuals: Array, regressors: Array, memory: float, usual: Array) -> Array:
    """sum r s / sqrt(sum s^2) over an exponential memory [s]; a tenth of the usual sum s^2 is added to it."""
    a = np.exp(-1.0 / memory)
    scored = lfilter([1.0], [1.0, -a], residuals * regressors, axis=0)
    power = lfilter([1.0], [1.0, -a], regressors**2, axis=0) + memory * 0.1 * usual + 1e-12
    return scored / np.sqrt(power)


def _inputs(run: Array) -> Array:
    return np.column_stack([run[:, CV], (run[:, P1] - run[:, P2]) * 4e6])


def learn_symptoms(runs: Sequence[Array]) -> Symptoms:
    """From fault-free runs (n, 6): the relations from the first, bias and spread of the symptoms from all others."""
    first = runs[0][_SETTLE : _SETTLE + 3000]
    servo = learn_servo(_inputs(first), first[:, X])
    drop = first[:, P1] - first[:, P2]
    flow = learn_flow(drop / drop.mean(), first[:, X], first[:, F])
    process, n, memories = first[:, [P1, P2, T1]], len(SCORES), len(MEMORIES)
    usual, eyes = np.array([process.mean(axis=0), process.std(axis=0) + 1e-9]), np.stack([np.eye(n)] * memories)
    blank = Symptoms(servo, flow, float(drop.mean()), usual, np.zeros(n), np.ones(n), np.ones((memories, n)), eyes)
    others = runs[1:] or runs
    sums = np.sum([_projected(*blank.parts(run)) for run in others], axis=0)
    kept = sum(len(run) - _SETTLE for run in others)
    centred = replace(blank, bias=sums[0] / (sums[1] + 1e-12), power=sums[1] / kept)
    raw = np.concatenate([centred.raw(run)[_SETTLE::_THIN] for run in others])
    spread = np.sqrt(np.mean(raw**2, axis=0)) + 1e-9
    return replace(centred, spread=spread, whitener=np.stack([_whitener(z) for z in np.moveaxis(raw / spread, 1, 0)]))


def _whitener(scores: Array) -> Array:
    """From scores (n, n_scores) of unit spread to uncorrelated ones; directions that hardly occur keep a floor."""
    values, vectors = np.linalg.eigh(scores.T @ scores / len(scores))
    return vectors / np.sqrt(np.maximum(values, 0.02))


def _projected(residuals: Array, regressors: Array) -> Array:
    """Sums of r s and of s^2 (2, n_scores)."""
    kept = slice(_SETTLE, None)
    return np.array([(residuals * regressors)[kept].sum(axis=0), (regressors[kept] ** 2).sum(axis=0)])
