"""What learning data show that is not as assumed: drift, and a size that changes. At a level of 1 % each."""

from __future__ import annotations

import math

import numpy as np

from recordings import Array

DRIFTS, CHANGING = "the residual drifts", "the residual's size changes"
_BEYOND = 2.576


def findings(z: Array, block: int) -> tuple[str, ...]:
    """Words for what is found in a standardised residual (n_samples,), with `block` samples long against its memory.

    Rank correlation of the blocks' means and sizes with time (Mann 1945), and of the size from one block to the next.
    """
    n = len(z) // block
    rows = np.clip(z[: n * block], -4.0, 4.0).reshape(n, block)
    mean, size = rows.mean(axis=1), np.abs(rows).mean(axis=1)
    time = np.arange(n, dtype=float)
    said = []
    if abs(_ranked(time, mean)) * math.sqrt(n - 1) > _BEYOND:
        said.append(DRIFTS)
    changing = abs(_ranked(time, size)), abs(_ranked(size[:-1], size[1:]))
    if max(changing) * math.sqrt(n - 1) > _BEYOND:
        said.append(CHANGING)
    return tuple(said)


def _ranked(a: Array, b: Array) -> float:
    """Spearman's rank correlation; equal values, as of quantised data, have equal ranks."""
    from scipy.stats import rankdata  # takes half a second to load, and whoever only reads a file learns nothing

    deviations = [ranks - ranks.mean() for ranks in (rankdata(a), rankdata(b))]
    return float(deviations[0] @ deviations[1] / max(math.sqrt(np.prod([row @ row for row in deviations])), 1e-300))
