"""First-order reversal curves as they are measured, and as a table on a grid of the input (figure 2.11)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter


@dataclass(frozen=True)
class ReversalCurve:
    """A first-order curve: input (n_samples), falling from the reversal value alpha, and output (n_samples) on the way.

    Raises BadParameter for rows that differ or are not finite, and for an input that does not fall.
    """

    input: Array
    output: Array

    def __post_init__(self) -> None:
        u, f = np.asarray(self.input, dtype=float), np.asarray(self.output, dtype=float)
        if u.shape != f.shape or u.ndim != 1 or len(u) < 1 or not (np.isfinite(u).all() and np.isfinite(f).all()):
            raise BadParameter("output", f.shape, f"it is no finite row beside inputs {u.shape}", "give equal rows")
        if not (np.diff(u) < 0).all():
            raise BadParameter("input", "", f"it does not fall from {u[0]:g} on", "give the part after the reversal")
        object.__setattr__(self, "input", u)
        object.__setattr__(self, "output", f)

    @property
    def alpha(self) -> float:
        """The input at the reversal."""
        return float(self.input[0])


def first_order_curves(operator: Callable[[float], float], levels: ArrayLike, samples: int = 1) -> list[ReversalCurve]:
    """The first-order curves of an operator (update) at rising levels (n_levels), from saturation below each time.

    samples : of each curve between two levels. It is what a rig does: down to the lowest level, up to alpha, and down.
    """
    u = np.asarray(levels, dtype=float)
    fine = np.interp(np.arange((len(u) - 1) * samples + 1) / samples, np.arange(len(u)), u)
    found = []
    for i, alpha in enumerate(u):
        operator(u[0])
        path = fine[i * samples :: -1] if i else fine[:1]
        found.append(ReversalCurve(path, np.array([operator(float(v)) for v in (alpha, *path[1:])])))
    return found


def tabulated(curves: Sequence[ReversalCurve], noise: float = 0.0) -> tuple[Array, Array]:
    """Levels (n) and outputs f[i, j] (n, n) at input level j on the curve from level i, NaN where j > i.

    The levels are the reversal values. The lowest curve may be one sample: the point of negative saturation.
    noise : standard deviation of the outputs; curves have crossed where they differ the wrong way by 6 of them.
    Raises BadParameter for fewer than two curves, two from one reversal value, curves with gaps and crossing curves.
    """
    curves = sorted(curves, key=lambda curve: curve.alpha)
    levels = np.array([curve.alpha for curve in curves])
    if len(curves) < 2 or not (np.diff(levels) > 0).all():
        raise BadParameter("curves", len(curves), "too few, or two from one reversal value", "give two or more, apart")
    table = np.full((len(levels), len(levels)), np.nan)
    for i, curve in enumerate(curves):
        _check_gaps(curve, levels[: i + 1])
        table[i, : i + 1] = np.interp(levels[: i + 1], curve.input[::-1], curve.output[::-1])
    check_crossing(levels, table, noise)
    return levels, table


def _check_gaps(curve: ReversalCurve, levels: Array) -> None:
    """The curve goes down to the lowest level, with a sample between any two levels or on one of them."""
    name = f"from {curve.alpha:g}"
    if curve.input[-1] > levels[0] + 1e-9 * np.ptp(levels):
        found = f"it ends at {curve.input[-1]:g}, before {levels[0]:g}, the lowest reversal value"
        raise BadParameter("curves", name, found, "each curve goes down to the lowest reversal value")
    between = np.diff(np.searchsorted(levels, curve.input[::-1], side="left"))
    wide = np.flatnonzero(between > 1)
    if len(wide):
        high, low = curve.input[::-1][wide[-1] + 1], curve.input[::-1][wide[-1]]
        found = f"it has a gap from {high:g} to {low:g}, with a level of another curve in it"
        raise BadParameter("curves", name, found, "each curve has a sample between any two levels")


def check_crossing(levels: Array, table: Array, noise: float) -> None:
    """Raises BadParameter unless, of a table as of `tabulated`, a curve from further up lies above at every input."""
    least = -6 * noise - 1e-9 * np.nanmax(np.abs(table))
    for i, j in zip(*np.nonzero(np.diff(table, axis=0) < least), strict=True):
        found = f"at {levels[j]:g} it lies below the one from {levels[i]:g}"
        remedy = "measured curves do not cross: average, or leave one out"
        raise BadParameter("curves", f"from {levels[i + 1]:g}", found, remedy)
