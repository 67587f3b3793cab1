"""Backlash and backlash-like hysteresis from measured input and output (equation 2.36, 2.39)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from recordings import Array, BadInput, BadParameter
from simulator.backlash.lines import Backlash
from simulator.backlash.smooth import SmoothBacklash


class BacklashFit(NamedTuple):
    """slope m and crossings left cl, right cr of (2.36), the output at the start, and the RMS error of the output."""

    slope: float
    left: float
    right: float
    start: float
    rmse: float


class SmoothBacklashFit(NamedTuple):
    """alpha, c and B1 of (2.39), and the RMS error of the output when it is run from the first measured value."""

    alpha: float
    c: float
    b1: float
    rmse: float


def fit_backlash(input: ArrayLike, output: ArrayLike) -> BacklashFit:
    """The backlash (2.36) whose output is nearest to a measured one, by least squares of the whole run.

    input, output (n_samples). It starts from the parallel lines through the samples at which the output moves.
    Raises BadParameter for rows that differ or are too short, BadInput where they show no backlash: no gap, or no
    rising line.
    """
    v, u = _rows(input, output)
    slope, low, high = _parallel_lines(v, u)
    scale = max(float(np.ptp(v)), 1e-300)

    def run(p: Array) -> Array:
        model = Backlash(abs(p[0]) * slope, *_ordered(p[1:3] * scale), start=float(p[3] * slope * scale))
        return np.array([model.update(float(x)) for x in v])

    first = np.array([1.0, low / scale, high / scale, u[0] / (slope * scale)])
    found = least_squares(lambda p: (run(p) - u) / (slope * scale), first, x_scale="jac", diff_step=1e-4)
    left, right = _ordered(found.x[1:3] * scale)
    error = float(np.sqrt(np.mean((run(found.x) - u) ** 2)))
    return BacklashFit(abs(float(found.x[0])) * slope, left, right, float(found.x[3] * slope * scale), error)


def fit_smooth_backlash(input: ArrayLike, output: ArrayLike) -> SmoothBacklashFit:
    """The backlash-like hysteresis (2.39) whose output is nearest to a measured one, run from its first value.

    input, output (n_samples). Each move between samples gives dw = alpha c integral of v abs(dv) - alpha integral of
    w abs(dv) + B1 dv, linear in alpha c, alpha and B1: least squares of these is the start, that of the run the result.
    Raises BadParameter for rows that differ or are too short, BadInput where no such hysteresis is near.
    """
    v, w = _rows(input, output)
    dv, middle, held = np.diff(v), (v[1:] + v[:-1]) / 2, (w[1:] + w[:-1]) / 2
    columns = np.column_stack([np.abs(dv) * middle, -np.abs(dv) * held, dv])
    (alpha_c, alpha, b1), *_ = np.linalg.lstsq(columns, np.diff(w), rcond=None)
    if not (alpha > 0 and alpha_c / alpha > b1):
        found = f"the least squares have alpha {alpha:g}, c {alpha_c / alpha if alpha else np.nan:g}, B1 {b1:g}"
        raise BadInput("output", found, "alpha > 0 and c > B1: give an input that reverses, with a loop in the output")
    start = np.array([np.log(alpha), np.log(alpha_c / alpha - b1), b1])

    def run(p: Array) -> Array:
        b = float(p[2])
        model = SmoothBacklash(float(np.exp(p[0])), b + float(np.exp(p[1])), b, (float(v[0]), float(w[0])))
        return np.array([model.update(float(x)) for x in v])

    found = least_squares(lambda p: run(p) - w, start, x_scale="jac")
    alpha, gap, b1 = float(np.exp(found.x[0])), float(np.exp(found.x[1])), float(found.x[2])
    return SmoothBacklashFit(alpha, b1 + gap, b1, float(np.sqrt(np.mean(found.fun**2))))


def _rows(input: ArrayLike, output: ArrayLike) -> tuple[Array, Array]:
    v, u = np.asarray(input, dtype=float), np.asarray(output, dtype=float)
    if v.shape != u.shape or v.ndim != 1 or len(v) < 8 or not (np.isfinite(v).all() and np.isfinite(u).all()):
        raise BadParameter("output", u.shape, f"beside inputs {v.shape}", "give equal finite rows, eight or more")
    return v, u


def _parallel_lines(v: Array, u: Array) -> tuple[float, float, float]:
    """Slope and crossings of two parallel lines, through where the output rises and where it falls."""
    du = np.diff(u)
    moved = np.abs(du) > 0.5 * np.quantile(np.abs(du), 0.9)
    rises, falls = moved & (du > 0), moved & (du < 0)
    if not (rises.any() and falls.any()):
        raise BadInput("output", "it does not move both ways", "give an input that reverses by more than the gap")
    taken = rises | falls
    columns = np.column_stack([v[1:], -rises.astype(float), -falls.astype(float)])[taken]
    (slope, right, left), *_ = np.linalg.lstsq(columns, u[1:][taken], rcond=None)
    if not slope > 0:
        raise BadInput("output", f"it does not rise with the input: slope {slope:g}", "m > 0")
    return float(slope), float(left / slope), float(right / slope)


def _ordered(crossings: Array) -> tuple[float, float]:
    low, high = float(crossings.min()), float(crossings.max())
    return low, max(high, low + 1e-12 * (1 + abs(low)))
