"""Judgement of models on held-out recordings, and whether anything is left to explain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from identification.data.grid import Grid
from identification.estimators.estimate import OUTLIER, Estimate
from identification.estimators.least_squares import cauchy
from recordings import Array

BLOCK = 1.0
"""Length of the blocks that are taken for independent [s]."""
FEW = 3
"""Blocks on which alone no gain may rest."""
COMPLETE = 1.05
"""Mean loss of the complete model at most: 1, and what linearisation leaves."""
UNIT_SPREAD = 1.264
"""Standard deviation of the loss of a unit normal innovation, in means of it."""
OUTLIERS = 1e-3
"""Share of outliers that it leaves at most."""


@dataclass(frozen=True)
class Comparison:
    """One model against another on the same grids. gain : fall of the cost; t : Student's t of it over blocks;
    p_value : one-sided; elsewhere : fall of the cost beside the `FEW` blocks where it fell most.
    """

    gain: float
    t: float
    p_value: float
    elsewhere: float


def compare(before: Estimate, after: Estimate, grids: tuple[Grid, ...]) -> Comparison:
    """How much better the second estimate explains the position, block by block."""
    gains = np.concatenate([_blocks(_robust(before, i) - _robust(after, i), grid) for i, grid in enumerate(grids)])
    spread = float(np.std(gains, ddof=1)) or 1e-12
    value = float(np.mean(gains)) / (spread / np.sqrt(len(gains)))
    elsewhere = float(np.sort(gains)[:-FEW].sum())
    return Comparison(float(gains.sum()), value, float(student.sf(value, len(gains) - 1)), elsewhere)


def _robust(estimate: Estimate, i: int) -> Array:
    """Robust loss plus log variance of the innovations of one grid (n,)."""
    line = estimate.linearised[i]
    seen = np.isfinite(line.variances)
    variances = np.where(seen, line.variances, 1.0)
    loss = cauchy(np.where(seen, line.innovations, 0.0) / np.sqrt(variances), estimate.tuning)
    return np.asarray((loss + np.log(variances)).sum(axis=1), float)


def _blocks(values: Array, grid: Grid) -> Array:
    """Sums over blocks of time."""
    block = np.floor((grid.t - grid.t[0]) / BLOCK).astype(int)
    return np.asarray(np.bincount(block, values), float)


@dataclass(frozen=True)
class Whiteness:
    """Whether innovations are noise of the size the recording has. loss : mean loss, 1 for a complete model."""

    white: bool
    p_value: float
    loss: float
    outliers: float


def whiteness(estimate: Estimate) -> Whiteness:
    """Test of the position's innovations: their mean loss, of independent samples if the model is complete, and their
    outliers.
    """
    p_value = float(norm.sf((estimate.loss - COMPLETE) / (UNIT_SPREAD / np.sqrt(estimate.samples))))
    if estimate.outliers > OUTLIERS:
        p_value = min(p_value, float(norm.sf(OUTLIER)))
    return Whiteness(p_value > 0.01, p_value, estimate.loss, estimate.outliers)
