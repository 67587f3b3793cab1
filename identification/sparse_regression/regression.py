"""What sliding says of a valve: spring, preload and friction at the speeds that were seen, with intervals.

The values are linear in the measured force: a matrix times it. So the same matrix makes the same values of any other
force in the same windows, and both can be compared with no error of the method between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from identification.sparse_regression.library import Library, chosen_terms, library_for
from identification.sparse_regression.sliding import Sliding
from recordings import Array

SURE = 0.9
"""Probability of the intervals."""
FEWEST_WINDOWS, FEWEST_BLOCKS = 20, 3
"""Windows and blocks of them needed in either direction."""
SHORT = 0.2
"""Share of the range of motion over which a stem has to slide in either direction."""
DIES_OUT = 4.0
"""Presliding lengths after a start or turn from which a stem counts as sliding: 2 % of presliding are left."""
EVEN = 0.03
"""Share of the speed by which it may change over a presliding length: friction follows it with such a lag."""
SLOW, MIDDLE, FAST = 0.1, 0.5, 0.9
"""Quantiles of the speed: friction is stated at the outer ones, the middle of the directions at the inner one."""
SLOPE = "slope of friction"
"""Name of the slope of friction with speed, between the slow and the fast level."""
SINGULAR = 1e-9
"""Share of the largest singular value below which terms are one and the same."""
APART = 1.2
"""Ratio of speeds from which they count as different."""


@dataclass(frozen=True)
class SlidingQuantity:
    """A quantity that sliding shows. name; unit; value; half [unit] : half the width of its interval; size [unit] :
    what a force of 1 N would be in it.
    """

    name: str
    unit: str
    value: float
    half: float
    size: float


@dataclass(frozen=True)
class Regression:
    """A sparse regression of the force in sliding. quantities; kept : terms of the library that pysindy kept;
    friction [N] : mean level of sliding friction; unexplained : standard deviation of the residual, as a share of the
    force's; windows; matrix (n_quantities, n_windows) : makes the quantities of a force in the windows.
    """

    quantities: tuple[SlidingQuantity, ...]
    kept: tuple[str, ...]
    friction: float
    unexplained: float
    windows: Sliding
    matrix: Array


def regression(found: Sliding) -> Regression | str:
    """The regression in some windows of sliding, or a sentence that says what these lack."""
    if lack := _lacks(found):
        return lack
    library = library_for(found)
    way = DIES_OUT * library.length
    s = found.where((found.travelled > way) & (found.change * library.length < EVEN * found.v**2))
    if lack := _lacks(s):
        return f"{lack} at an even speed and more than {1e3 * way:.2g} mm after a start or turn"
    return _in(s, library)


def _in(s: Sliding, library: Library) -> Regression:
    """The regression in windows that are enough for it."""
    columns, blocks = library.of(s), len(np.unique(s.block))
    kept = chosen_terms(columns, s.force, blocks)
    asked, rows = _asked(s, library)
    basis, rows = _basis(columns[:, kept], rows[:, kept])
    matrix, error = rows @ basis.T, s.force - basis @ (basis.T @ s.force)
    values = matrix @ s.force
    half = student.ppf(0.5 + SURE / 2, blocks - 1) * _jackknifed(basis, rows, s)
    quantities = tuple(
        SlidingQuantity(name, unit, float(value), float(h), size)
        for (name, unit, size), value, h in zip(asked, values, half, strict=True)
    )
    names, friction = tuple(library.names[i] for i in kept), float(np.mean(values[2:6]))
    return Regression(quantities, names, friction, float(np.std(error) / np.std(s.force)), s, matrix)


def _lacks(s: Sliding) -> str:
    """What windows lack for a regression, in words; empty where it is enough."""
    span = float(np.ptp(s.x)) if len(s) else 0.0
    for word, sign in (("rising", 1.0), ("falling", -1.0)):
        side = s.direction == sign
        if side.sum() < FEWEST_WINDOWS or len(np.unique(s.block[side])) < FEWEST_BLOCKS:
            return f"the stem slides too little {word}: {side.sum()} windows"
        if np.ptp(s.x[side]) < SHORT * span:
            return f"the stem slides too short a way {word}"
    slow, _, fast = _speeds(s)
    return "the stem slides at other speeds rising than falling" if slow > APART * fast else ""


def _speeds(s: Sliding) -> tuple[float, float, float]:
    """Slow, middle and fast speeds [m/s] that both directions show; slow above fast where they share none."""
    both = [np.quantile(np.abs(s.v[s.direction == sign]), [SLOW, MIDDLE, FAST]) for sign in (1.0, -1.0)]
    slow, fast = float(max(both[0][0], both[1][0])), float(min(both[0][2], both[1][2]))
    return slow, float(np.clip(min(both[0][1], both[1][1]), slow, max(slow, fast))), fast


def _asked(s: Sliding, library: Library) -> tuple[list[tuple[str, str, float]], Array]:
    """Names, units and sizes of the quantities, and what makes them of the coefficients (n_quantities, n_terms)."""
    slow, middle, fast = _speeds(s)

    def at(x: float, v: float) -> Array:
        point = (np.array([z]) for z in (x, v, 0.0, np.sign(v), np.inf))
        return library.columns(*point)[0]

    def centre(x: float) -> Array:
        return np.asarray(0.5 * (at(x, middle) + at(x, -middle)))

    x, span = library.middle, float(np.ptp(s.x))
    rate = (centre(x + span / 4) - centre(x - span / 4)) / (span / 2)
    asked, rows = [("spring.K", "N/m", 2 / span), ("spring.F0", "N", 1.0)], [rate, centre(0.0)]
    for speed in (slow, fast):
        words = f"{1e3 * speed:.3g} mm/s"
        asked += [(f"friction rising, {words}", "N", 1.0), (f"friction falling, {words}", "N", 1.0)]
        rows += [at(x, speed) - centre(x), centre(x) - at(x, -speed)]
    if fast > APART * slow:
        both = [0.5 * (at(x, v) - at(x, -v)) for v in (slow, fast)]
        asked.append((SLOPE, "N s/m", 1.0 / (fast - slow)))
        rows.append((both[1] - both[0]) / (fast - slow))
    return asked, np.array(rows)


def _basis(columns: Array, rows: Array) -> tuple[Array, Array]:
    """An orthonormal basis (n_windows, r) of some columns, and the rows of coefficients in it (n_quantities, r)."""
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    basis, strength, turn = np.linalg.svd(columns / size, full_matrices=False)
    told = strength > SINGULAR * strength[0]
    return basis[:, told], (rows / size) @ turn[told].T / strength[told]


def _jackknifed(basis: Array, rows: Array, s: Sliding) -> Array:
    """Standard deviations of the quantities by leaving out one block after the other (Tukey's jackknife): it holds for
    errors that hang together within a block and differ in size from block to block, and is on the safe side.
    """
    whole, without = basis.T @ s.force, []
    for block in np.unique(s.block):
        out = s.block == block
        matrix = np.eye(len(whole)) - basis[out].T @ basis[out]
        without.append(rows @ np.linalg.lstsq(matrix, whole - basis[out].T @ s.force[out], rcond=None)[0])
    spread = np.array(without) - np.mean(without, axis=0)
    return np.asarray(np.sqrt((len(without) - 1) / len(without) * np.sum(spread**2, axis=0)))
