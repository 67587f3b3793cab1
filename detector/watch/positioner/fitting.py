"""The loop that fault-free data ask for: robust least squares on its free run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from detector.measurements import Measurements
from detector.observer.calibration_fit import NOISE_ORDER
from detector.watch.positioner.kernel import CURVE, PUSH, SLOPE, follow
from detector.watch.positioner.loop import BEFORE_IT, BEHIND_IT, N_ANSWERS, SETPOINT, PositionerLoop
from recordings import Array, white_noise

KNOTS = 5
MOST_SAMPLES, FIRST_SAMPLES = 20_000, 5_000
"""A fit uses so many samples at most, and so many while the best of its starts is looked for."""

LEAST_SAMPLES = 200
EXPLAINED = 0.9
"""What the loop explains of the variance of the position at least: otherwise the set point does not lead it."""

_SETTLED = 30
_MOVES = 3.0
_STARTS = ((5.0, 0.1, 0.03), (5.0, 0.03, 0.1), (1.0, 1.0, 1.0), (0.1, 0.05, 0.05))
"""Gain and limits of speed that a fit starts from: valves vent slower than they fill, fill slower, or are slow."""

_LOW = np.array([0.01, 1e-3, 1e-3, -1.0, -3.0, 0.0, 0.0, 0.0, *[-0.5] * KNOTS])
_HIGH = np.array([20.0, 10.0, 10.0, 1.0, 3.0, 0.2, 0.2, 20.0, *[1.5] * KNOTS])
_SCALE = np.array([1.0, 0.1, 0.1, 0.1, 1.0, 0.01, 0.01, 0.1, *[0.1] * KNOTS])
_SMALL = 5e-3
"""An error of so much of the stroke counts squared, a larger one less."""


def learned_positioner(data: Measurements) -> tuple[PositionerLoop, Array] | None:
    """The loop fitted to the first half of fault-free data, and its residuals (n_samples,) on all of them: on the
    second half it has seen nothing beforehand, as in service. None without a set point that leads the position.
    """
    blank = _blank(data) if SETPOINT in data else None
    loop = None if blank is None else _fitted(blank, data[: len(data) // 2])
    return None if loop is None else (loop, loop.run(data)[0])


def _blank(data: Measurements) -> PositionerLoop | None:
    """Ranges and knots, nothing fitted; None where set point or position hardly move."""
    x, u = data.values["position"], data.values[SETPOINT]
    good = np.isfinite(x) & np.isfinite(u)
    if good.sum() < LEAST_SAMPLES or not np.ptp(u[good]) > 0:
        return None
    low, high = np.quantile(x[good], (0.005, 0.995))
    usual, span = _drop(data)
    lowest, highest = float(u[good].min()), float(u[good].max())
    loop = PositionerLoop(
        (0.0,) * (CURVE + KNOTS), float(low), float(high - low), lowest, (highest - lowest) / (KNOTS - 1), usual, span,
        (lowest, highest), (0.0, 0.0), 1.0, (1.0,) * N_ANSWERS, float(np.median(np.diff(data.time_s))),
    )  # fmt: skip
    drops = loop.rows(data)[:, 2]
    return replace(loop, drops=(float(np.nanmin(drops)), float(np.nanmax(drops))))


def _drop(data: Measurements) -> tuple[float, float]:
    """Usual pressure drop and its range [Pa]; zeros where it is not measured, or does not leave its noise."""
    if BEFORE_IT not in data or BEHIND_IT not in data:
        return 0.0, 0.0
    drop = data.values[BEFORE_IT] - data.values[BEHIND_IT]
    drop = drop[np.isfinite(drop)]
    if not np.std(drop) > _MOVES * white_noise(drop, NOISE_ORDER):
        return 0.0, 0.0
    low, high = np.quantile(drop, (0.005, 0.995))
    return float(np.mean(drop)), float(high - low)


def _fitted(blank: PositionerLoop, data: Measurements) -> PositionerLoop | None:
    """A loop fitted to data from several starts; None where it explains too little."""
    rows = blank.rows(data)
    rows = rows[np.isfinite(rows).all(axis=1)][:MOST_SAMPLES]
    if len(rows) < LEAST_SAMPLES:
        return None
    first = rows[:FIRST_SAMPLES]
    tried = [_solved(blank, first, _start(blank, first, one)) for one in _STARTS]
    constants = _solved(blank, rows, min(tried, key=lambda one: one[1])[0])[0]
    left = rows[:, 3] - _run(blank, rows, constants)
    deviation = max(float(np.std(left[_SETTLED:])), 1e-6)
    if deviation**2 > (1.0 - EXPLAINED) * float(np.var(rows[:, 3])):
        return None
    found = replace(blank, constants=tuple(constants.tolist()), deviation=deviation)
    return replace(found, powers=tuple(np.mean(found.run(data)[1] ** 2, axis=0).tolist()))


def _start(blank: PositionerLoop, rows: Array, rates: tuple[float, ...]) -> Array:
    """Constants to start from: a straight line, and the sign with which the drop moves the position."""
    straight = np.polyfit(rows[:, 1], rows[:, 3], 1)
    left = rows[:, 3] - np.polyval(straight, rows[:, 1])
    push = 0.1 * float(np.sign(left @ rows[:, 2]))
    knots = blank.lowest + blank.width * np.arange(KNOTS)
    return np.array([*rates, push, 0.1, 0.005, 0.005, 0.2, *np.polyval(straight, knots)])


def _solved(blank: PositionerLoop, rows: Array, start: Array) -> tuple[Array, float]:
    """Constants and what they cost, by least squares; those of the drop only where it is used."""
    from scipy.optimize import least_squares

    free = np.ones(len(start), bool)
    free[[PUSH, SLOPE]] = bool(blank.drop_span)
    start = np.clip(np.where(free, start, 0.0), _LOW, _HIGH)

    def errors(values: Array) -> Array:
        constants = start.copy()
        constants[free] = values
        return (rows[:, 3] - _run(blank, rows, constants))[_SETTLED:]

    found = least_squares(errors, start[free], bounds=(_LOW[free], _HIGH[free]), x_scale=_SCALE[free], loss="soft_l1",
                          f_scale=_SMALL, diff_step=1e-3, max_nfev=60)  # fmt: skip
    best = start.copy()
    best[free] = found.x
    return best, float(found.cost)


def _run(blank: PositionerLoop, rows: Array, constants: Array) -> Array:
    out = np.empty(len(rows))
    follow(rows, blank.gap_s, blank.lowest, blank.width, constants, out)
    return out
