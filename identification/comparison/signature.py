"""The signature of a valve: the force in strokes and places, and the line that they lie beside.

A stem that moves slowly, or has come to rest after a step, lies near K x + F0 + d f, with d the direction in which it
moved last. So the mean forces of strokes in bins along the travel have the spring rate as their slope over the
position, and friction as half the distance of the two directions. What strokes in the same direction differ by is what
the valve does not repeat.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.comparison.strokes import Stroke, strokes
from identification.data.experiment import Experiment, Segment
from recordings import Array, NegativeAnswer

BINS = 20
"""Bins along the common travel."""
FEWEST = 3
"""Samples that a bin of a stroke needs to count: fewer are the passage of a slip."""
EACH_WAY = 2
"""Strokes in each direction at least: of one nothing is known of what repeats."""
PLACES = 3
"""Bins that they reach together at least, for a line along the travel."""


@dataclass(frozen=True)
class Signature:
    """Mean forces of strokes in bins. name : of the recording; x (n_bins,) : middles of the bins [m]; force (n_strokes,
    n_bins) [N] : NaN where a stroke hardly was; direction (n_strokes,) : 1 or -1; speed [m/s] : median in motion;
    moving : share of the time in motion.
    """

    name: str
    x: Array
    force: Array
    direction: Array
    speed: float
    moving: float


def travel(e: Experiment) -> tuple[float, float]:
    """Lowest and highest position of an experiment [m], but for a hundredth at each end."""
    x = np.concatenate([s.motion.x for s in e.segments])
    low, high = np.quantile(x, (0.01, 0.99))
    return float(low), float(high)


def signature(e: Experiment, low: float, high: float) -> Signature:
    """The signature of an experiment between two positions [m]. Raises NegativeAnswer for too few strokes."""
    edges = np.linspace(low, high, BINS + 1)
    found = [(stroke, _binned(s, stroke, edges)) for s in e.segments for stroke in strokes(s.motion.x)]
    kept = [(stroke.direction, force) for stroke, force in found if np.isfinite(force).any()]
    direction = np.array([way for way, _ in kept], float)
    counts = [int(np.sum(direction == way)) for way in (1, -1)]
    force = np.array([row for _, row in kept]).reshape(-1, BINS)
    if min(counts) < EACH_WAY or np.isfinite(force).any(axis=0).sum() < PLACES:
        raise NegativeAnswer(
            f"{e.name}: cannot tell what changed: {counts[0]} strokes up and {counts[1]} down in the common travel, "
            f"{EACH_WAY} each way and to {PLACES} places are needed; record an ordinary step test of five strokes"
        )
    v = np.concatenate([np.abs(s.motion.v[s.motion.crept != 0.0]) for s in e.segments])
    moving = len(v) / sum(len(s.t) for s in e.segments)
    return Signature(e.name, 0.5 * (edges[1:] + edges[:-1]), force, direction, float(np.median(v)), moving)


def _binned(s: Segment, stroke: Stroke, edges: Array) -> Array:
    """Mean force of a stroke in every bin (n_bins,) [N], NaN where it hardly was. It counts from where the stem
    has left its place until the force begins to go back: at rest at both ends it goes from one line to the other.
    """
    part = slice(stroke.first, stroke.last)
    x, u = s.motion.x[part], s.u[part]
    gone = np.abs(x - x[0]) > edges[1] - edges[0]
    until = int(np.argmax(stroke.direction * u)) + 1
    counts = gone & (np.arange(len(x)) < until) & (x > edges[0]) & (x < edges[-1])
    place = np.searchsorted(edges, x[counts], side="right") - 1
    count = np.bincount(place, minlength=BINS)
    total = np.bincount(place, u[counts], minlength=BINS)
    return np.where(count >= FEWEST, total / np.maximum(count, 1), np.nan)


def line(s: Signature) -> tuple[Array, Array, float]:
    """Height at mid travel [N], slope [N/m] and friction [N] of the line beside which strokes lie, (3,), its covariance
    (3, 3) and the degrees of freedom of that.

    What strokes differ by is common to all their bins, so the covariance is that of clusters (Liang and Zeger,
    Biometrika 73, 1986), with the usual factor for few of them.
    """
    row, place = np.nonzero(np.isfinite(s.force))
    A: Array = np.column_stack([np.ones(len(row)), s.x[place] - s.x.mean(), s.direction[row]])
    b = s.force[row, place]
    inverse = np.linalg.pinv(A.T @ A)
    found = inverse @ A.T @ b
    left = b - A @ found
    clusters = [A[row == i].T @ left[row == i] for i in np.unique(row)]
    g, n = len(clusters), len(b)
    factor = g / (g - 1) * (n - 1) / max(n - 3, 1)
    meat = sum((np.outer(c, c) for c in clusters), np.zeros((3, 3)))
    return found, factor * inverse @ meat @ inverse, float(max(g - 3, 1))
