"""Half cycles of a signal: what lies between two zero crossings."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from recordings import Array


def smoothed(values: Array, width: int) -> Array:
    """Moving mean over an odd number of samples (n,); ends as they are."""
    width = max(1, width | 1)
    kernel = np.ones(width) / width
    inner = np.convolve(values, kernel, mode="valid")
    return np.concatenate([values[: width // 2], inner, values[len(values) - width // 2 :]])


def half_cycles(values: Array, period: float) -> list[Array]:
    """The half cycles of a signal (n,) without mean that last about half a period, each made positive."""
    soft = smoothed(values, int(period / 8))
    signs = np.where(soft >= 0, 1, -1)
    edges = np.flatnonzero(np.diff(signs)) + 1
    parts = (values[a:b] for a, b in pairwise(edges) if 0.25 < (b - a) / period < 0.85)
    return [part * np.sign(part.sum()) for part in parts if len(part) >= 5]


def misfit(part: Array, shape: Array) -> float:
    """Squared error of the best multiple of a shape (m,), as a share of the power of the half cycle (m,)."""
    size = float(part @ shape) / float(shape @ shape)
    return float(np.sum((part - size * shape) ** 2) / np.sum(part**2))


def sine(n: int) -> Array:
    """Half a sine, (n,)."""
    return np.asarray(np.sin(np.pi * (np.arange(n) + 0.5) / n), float)


def triangles(n: int) -> list[Array]:
    """Triangles over n samples with their peaks at several places."""
    x = (np.arange(n) + 0.5) / n
    return [np.minimum(x / p, (1 - x) / (1 - p)) for p in (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)]


def relays(n: int) -> list[Array]:
    """Half periods of the answer of first-order processes to a relay, (n,) each."""
    x = (np.arange(n) + 0.5) / n
    return [1 - 2 * np.exp(-x / tau) / (1 + np.exp(-1 / tau)) for tau in (0.05, 0.1, 0.2, 0.4, 0.8)]
