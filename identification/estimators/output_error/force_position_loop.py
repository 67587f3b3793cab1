"""Spring, preload and break-away force as an engineer reads them: from the loop of force over position.

Where the force changes slowly, K x + F0 +- fs holds it in: a valve that sticks reaches both sides before every slip,
and one that slides runs along them. So the narrowest band that holds all but a share of the ends of the loop, taken in
bins along the stroke, has K as its slope, F0 as its height and the level of friction as its half width. It is a linear
programme (the tube of a nu support vector regression: Schoelkopf et al., Neural Computation 12(5), 2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from identification.data.experiment import Experiment, Segment
from recordings import Array, IndexArray

BINS, FEWEST = 60, 6
"""Bins along the stroke, and samples that one needs to count."""
OUTSIDE = 0.2
"""Share of the ends of the loop that may lie outside the band."""
QUANTILE = 0.02
"""Share of the samples of a bin beyond what counts as its end."""
SLOW = 0.15
"""Largest change of the force from sample to sample, as a share of the half width: a faster one moves the mass."""
ROUNDS = 5


@dataclass(frozen=True)
class ForcePositionLoop:
    """The band u = K x + F0 +- level: K [N/m], F0 [N], level [N]."""

    K: float
    F0: float
    level: float

    def load(self, segment: Segment) -> Array:
        """The force that friction holds, as a share of the level, (n_samples,)."""
        return np.asarray(np.abs(segment.u - self.K * segment.motion.x - self.F0) / self.level, float)


def force_position_loop(experiments: Sequence[Experiment], stiffness: float | None = None) -> ForcePositionLoop | None:
    """The loop of some experiments; stiffness [N/m] : of the spring, where it is known. None where too few bins of the
    stroke are visited.
    """
    segments = [s for e in experiments for s in e.segments]
    x, u = (np.concatenate(part) for part in ([s.motion.x for s in segments], [s.u for s in segments]))
    rise = np.concatenate([np.abs(np.gradient(s.u)) for s in segments])
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    K, F0 = np.polyfit(x, u, 1) if stiffness is None else (stiffness, float(np.mean(u - stiffness * x)))
    level = float(np.std(u - K * x - F0))
    for _ in range(ROUNDS):
        ends = _ends(u - K * x - F0, place, rise < SLOW * level)
        if len(ends) < 3:
            return None
        more_K, more_F0, level = _band(middle[ends[:, 0].astype(int)], ends[:, 1], ends[:, 2], stiffness is None)
        K, F0 = K + more_K, F0 + more_F0
    return ForcePositionLoop(float(K), float(F0), float(level))


def _ends(left: Array, place: IndexArray, slow: NDArray[np.bool_]) -> Array:
    """Bin, lower and upper end of what spring and preload leave of the force, (n_bins, 3)."""
    rows = []
    for i in range(BINS):
        here = left[slow & (place == i)]
        if len(here) >= FEWEST:
            share = max(QUANTILE, 1.0 / len(here))
            rows.append((i, *np.quantile(here, [share, 1 - share])))
    return np.array(rows).reshape(-1, 3)


def _band(x: Array, lower: Array, upper: Array, sloped: bool) -> tuple[float, float, float]:
    """Slope, height and half width of the narrowest band around lower and upper ends (n,) at positions x (n,)."""
    n, wide, unit = len(x), float(np.ptp(x)) or 1.0, float(np.max(np.abs([lower, upper]))) or 1.0
    line = np.column_stack([(x - x.mean()) / wide, np.ones(n)])
    one, none, column = np.eye(n), np.zeros((n, n)), np.ones((n, 1))
    rows = np.block([[-line, -column, -one, none], [line, -column, none, -one]])
    cost = np.concatenate([[0.0, 0.0, 2 * n * OUTSIDE], np.ones(2 * n)])
    slope = (None, None) if sloped else (0.0, 0.0)
    free = [slope, (None, None), *[(0.0, None)] * (2 * n + 1)]
    found = linprog(cost, A_ub=rows, b_ub=np.concatenate([-upper, lower]) / unit, bounds=free, method="highs")
    if not found.success:
        return 0.0, 0.0, 0.5 * float(np.median(upper - lower))
    K, F0, level = found.x[:3] * unit
    return K / wide, F0 - K / wide * x.mean(), level
