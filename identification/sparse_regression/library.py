"""The library of candidate terms for the force of a sliding stem: spring and mass, and friction of a shape not known.

Friction may be any curve over speed, piecewise linear between `KNOTS` speeds, of its own for either direction; spring
and friction may vary along the stroke. Nothing here has a bristle: what is left of presliding in sliding is a force
that dies out with the way since the last start or turn, over a length that is found in the recording too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.sparse_regression.sliding import Sliding
from recordings import Array

KNOTS = 5
"""Speeds at which the friction curve may bend."""
ALWAYS = ("x", "1", "sgn v", "v")
"""Terms that stay: without them there is no spring, preload, friction or slope of it to compare."""
LENGTHS, SHORTEST, LONGEST = 25, 1e-4, 0.2
"""Presliding lengths that are tried: how many, from this share to that one of the range of motion."""
OVER = 20.0
"""Presliding lengths after which nothing of presliding is left."""
TOLD_APART = 16.0
"""Variances of the residual by which the sums of squares of two presliding lengths differ where they are told apart."""
LACKING = 0.2
"""Share of friction that is not there yet where a stem starts, at least."""
CONFIDENT = 3.0
"""Errors by which a term stands out where it is kept."""


@dataclass(frozen=True)
class Library:
    """Candidate terms. middle [m] : position about which they are counted; knots (n,) [m/s]; length [m] : over which
    presliding dies out.
    """

    middle: float
    knots: Array
    length: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the terms, in the order in which they are asked."""
        knots = [f"{1e3 * k:.3g} mm/s" for k in self.knots]
        curve, uneven = (tuple(f"{kind} below {k}" for k in knots) for kind in ("sgn v", "1"))
        return (*ALWAYS, "a", *curve, "presliding", "|v|", *uneven, "x sgn v", "x^2")

    def columns(self, x: Array, v: Array, a: Array, direction: Array, travelled: Array) -> Array:
        """The terms (n, n_terms) at positions [m], speeds [m/s], accelerations [m/s2] and ways [m], each (n,)."""
        along, speed = x - self.middle, np.abs(v)
        below = np.maximum(0.0, 1.0 - speed[:, None] / self.knots)
        ways = travelled / self.length
        left = np.where(ways < OVER, direction * np.exp(-np.minimum(ways, OVER)), 0.0)
        return np.column_stack([
            along, np.ones_like(x), direction, v, a, direction[:, None] * below, left,
            speed, below, along * direction, along**2,
        ])  # fmt: skip

    def of(self, s: Sliding) -> Array:
        """The terms (n_windows, n_terms) in windows."""
        return self.columns(s.x, s.v, s.a, s.direction, s.travelled)


def library_for(s: Sliding) -> Library:
    """The library for some windows of sliding: knots over their speeds, and the longest presliding length that explains
    their force as well as the best one does.
    """
    speed = np.abs(s.v)
    slow, fast = np.quantile(speed, [0.02, 0.98])
    knots = np.geomspace(1.2 * slow, max(fast, 1.3 * slow), KNOTS + 1)[:-1]
    middle, span = float(np.mean(s.x)), float(np.ptp(s.x))
    choices = [Library(middle, knots, float(d)) for d in span * np.geomspace(SHORTEST, LONGEST, LENGTHS)]
    upto = choices[0].names.index("presliding") + 1
    left = np.array([_left(one.of(s)[:, :upto], s.force) for one in choices])
    as_well = left <= left.min() * (1.0 + TOLD_APART / len(s))
    return choices[int(np.flatnonzero(as_well)[-1])]


def _left(columns: Array, force: Array) -> float:
    """The sum of squares that the terms up to presliding leave of a force. Presliding starts from a force of the other
    sign, or none, so that it lacks at least `LACKING` of friction at first: less is not presliding.
    """
    basis = np.linalg.svd(columns[:, :-1] / np.maximum(np.linalg.norm(columns[:, :-1], axis=0), 1e-300),
                          full_matrices=False)  # fmt: skip
    others = basis.U[:, 1e-9 * basis.S[0] < basis.S]
    own, rest = (z - others @ (others.T @ z) for z in (columns[:, -1], force))
    friction = 0.5 * abs(float(np.mean(force[columns[:, 2] > 0]) - np.mean(force[columns[:, 2] < 0])))
    size = float(own @ own)
    start = float(own @ rest) / size if size > 1e-12 * len(own) else 0.0
    return float(np.sum((rest - min(start, -LACKING * friction) * own) ** 2))


def chosen_terms(columns: Array, force: Array, blocks: int) -> list[int]:
    """Which terms (n_windows, n_terms) a sparse regression of the force keeps: pysindy's sequentially thresholded least
    squares (Brunton, Proctor, Kutz, PNAS 113(15), 2016).

    Every term is first freed of those before it, so that its coefficient is what it adds, in N rms; what adds less than
    `CONFIDENT` errors goes. blocks : number of blocks of windows whose errors are independent.
    """
    import pysindy as ps

    n = len(columns)
    basis, triangle = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))
    own = np.abs(np.diag(triangle)) > 1e-6
    error = force - basis @ (own * (basis.T @ force))
    threshold = max(CONFIDENT * float(np.std(error)) / np.sqrt(blocks), 1e-9 * float(np.std(force)))
    optimizer = ps.STLSQ(threshold=threshold, alpha=1e-12, max_iter=20)
    optimizer.fit(np.sqrt(n) * basis * own, force[:, None])
    kept = np.asarray(optimizer.coef_).ravel() != 0.0
    return [i for i in range(columns.shape[1]) if kept[i] or i < len(ALWAYS)]
