"""Fewer points, the same picture: long recordings are thinned before they are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from recordings import Array, IndexArray, Integers


def extremes(columns: Sequence[Array], most: int) -> IndexArray:
    """Indices, ascending, of at most about `most` samples that draw the same lines as all of them.

    columns : signals over one clock, each (n_samples,). Every stretch keeps where each signal is smallest and largest,
    and one sample that is not known where there is one, so that lines break at gaps.

    >>> kept = extremes([np.sin(np.arange(1000.0))], 60)
    >>> len(kept) <= 60, bool(0 in kept and 999 in kept)
    (True, True)
    """
    n, each = len(columns[0]), 3 * len(columns)
    if n <= most:
        return np.arange(n)
    size = int(np.ceil(n * each / max(most - 2, each)))
    first = np.arange(0, n, size)
    kept: list[IndexArray] = [np.array([0, n - 1])]
    for column in columns:
        block = np.append(column, np.full(len(first) * size - n, column[-1])).reshape(-1, size)
        unknown = np.isnan(block)
        kept.append(first + np.argmin(np.where(unknown, np.inf, block), axis=1))
        kept.append(first + np.argmax(np.where(unknown, -np.inf, block), axis=1))
        kept.append((first + np.argmax(unknown, axis=1))[unknown.any(axis=1)])
    return np.unique(np.minimum(np.concatenate(kept), n - 1))


def cells(x: Array, y: Array, across: int, up: int) -> tuple[IndexArray, IndexArray]:
    """One index per occupied cell of an `across` by `up` raster over finite points x, y, and the points in the cell.

    The fullest cells come first. A cloud thinned like this keeps its outline and its rare points.
    """
    if not len(x):
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    column, row = _raster(x, across), _raster(y, up)
    _, kept, count = np.unique(column * up + row, return_index=True, return_counts=True)
    order = np.argsort(-count, kind="stable")
    return kept[order], count[order]


def _raster(values: Array, parts: int) -> Integers:
    low, width = values.min(), np.ptp(values) or 1.0
    return np.minimum((values - low) / width * parts, parts - 1).astype(np.int64)
