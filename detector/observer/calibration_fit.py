"""The calibration that fault-free data ask for: scaling, parameters, velocity filter, and threshold.

alpha1, alpha4, alpha5 are the least squares of x2' = -alpha1 x2 - alpha5 x1 + alpha4 u + c on filtered data. The
threshold is what the laws (4.20) come to: from a small b1 they run over the data again and again, until nowhere the
residual leaves their dead zone. So the networks learn how large the model's error is at which speed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from detector.measurements import INPUTS, Measurements
from detector.observer.calibration import GAP_SAMPLES, SETTLE_SAMPLES, Calibration
from detector.observer.observer import Bounds
from detector.observer.state import ObserverState
from detector.observer.velocity import SteadyKalman, negative_log_likelihood
from recordings import Array, BadInput, white_noise

NOISE_ORDER = 3
"""Of the difference that noise is estimated from: it removes what moves with a steady acceleration."""

_MOST_ROUNDS = 200
_GROWTH = 0.005
"""What a sample beyond the dead zone adds to b1 while the threshold is learned, as a share of Phi."""

_TOP = 0.995
"""Quantile of a signal's size that counts as its largest."""

_LEAST_SAMPLES = 200
_LEAST_ALPHA = 1e-6
_WIDE = 1e12
_QUIET = 10.0
"""A valve moves when its position ranges over more than this many times its noise."""

_JERKS = 10.0 ** np.arange(-4.0, 7.1, 0.5)
"""Tried intensities of the white jerk, in spans: the likeliest is taken."""


def calibrate(data: Measurements) -> Calibration:
    """The observer that fault-free data ask for.

    Of the signals that may stand for the input the one is taken whose model leaves the least error. Raises BadInput
    when nothing can be learned from the data: too few, no motion, or no input.
    """
    dt_s, scaled = _prepared(data)
    fits = [_fitted(data, scaled, name, dt_s) for name in INPUTS if name in data]
    candidates = [one for one in fits if one is not None]
    if not candidates:
        raise BadInput("calibration", "no input moves in the data", f"record one of {', '.join(INPUTS)} in motion")
    return _with_threshold(min(candidates, key=lambda one: one.error), data)


def healthy_residual(data: Measurements, calibration: Calibration) -> Array:
    """The observer's residual on fault-free data (n_samples,) [m/s]: each half by the parameters of the other, for on
    data that it was calibrated to an observer looks better than it is. Raises BadInput where a half has no motion.
    """
    dt_s, scaled = _prepared(data)
    half, found = len(data) // 2, list[Array]()
    for seen, other in ((data[:half], data[half:]), (data[half:], data[:half])):
        part = replace(scaled, x1=(other.values["position"] - scaled.zero) / scaled.span)
        fitted = _fitted(other, part, calibration.input, dt_s)
        if fitted is None:
            raise BadInput("calibration", "the input rests in a half of the data", "learn while the valve moves")
        found.append(_like(fitted, calibration).residuals(seen))
    return np.concatenate(found)


def _like(fitted: Calibration, calibration: Calibration) -> Calibration:
    """A calibration with the threshold and the sets of another one."""
    names = ("b1", "e1", "w1", "w2", "top_speed", "top_position", "top_input")
    return replace(fitted, **{name: getattr(calibration, name) for name in names})


def _with_threshold(calibration: Calibration, data: Measurements) -> Calibration:
    """With what the laws come to on the data, the alphas held."""
    wide = Bounds(_WIDE, _WIDE, _WIDE, _WIDE, _WIDE, _WIDE, _WIDE)
    gains = calibration.weight_gains(_GROWTH * calibration.observer.k2 / calibration.dt_s)
    still = replace(calibration.compiled, weight_gain=gains, alpha_gain=0.0, bounds=wide, least_speed=0.0, freeze=False)
    rows, state = calibration.scaled(data), still.initial()
    for _ in range(_MOST_ROUNDS):
        before = state
        state = still.run(still.initial().with_estimates(state), *rows)[0]
        if _same_estimates(before, state):
            break
    return replace(
        calibration, b1=state.estimates["b1"], e1=state.estimates["e1"], w1=tuple(state.w1.tolist()),
        w2=tuple(state.w2.tolist()),
    )  # fmt: skip


def _same_estimates(one: ObserverState, other: ObserverState) -> bool:
    return one.estimates == other.estimates and np.array_equal(one.w1, other.w1) and np.array_equal(one.w2, other.w2)


@dataclass(frozen=True)
class _Scaled:
    """Position x1 (n_samples,) in spans of it, its noise, and its jerk."""

    x1: Array
    zero: float
    span: float
    noise: float
    jerk: float = 0.0


def _prepared(data: Measurements) -> tuple[float, _Scaled]:
    """The sampling time and the scaled position. Raises BadInput for data that nothing can be learned from."""
    if len(data) < _LEAST_SAMPLES:
        found = f"{len(data)} samples are too few to learn from"
        remedy = f"give {_LEAST_SAMPLES} at least, in motion; a few hundred seconds are good"
        raise BadInput("calibration", found, remedy)
    dt_s = float(np.median(np.diff(data.time_s)))
    x = data.values["position"]
    good = x[np.isfinite(x)]
    low, high = np.quantile(good, (0.005, 0.995)) if len(good) else (0.0, 0.0)
    span, noise = float(high - low), white_noise(good, NOISE_ORDER)
    if not span > _QUIET * noise or span <= 0:
        found = f"the valve does not move: its position ranges over {span:.3g} m, its noise is {noise:.2g} m"
        raise BadInput("calibration", found, "learn while the valve moves over its usual range")
    middle = float(low + high) / 2
    scaled = _Scaled((x - middle) / span, middle, span, max(noise / span, 1e-5))
    return dt_s, replace(scaled, jerk=_likely_jerk(scaled, dt_s))


def _fitted(data: Measurements, scaled: _Scaled, name: str, dt_s: float) -> Calibration | None:
    """The least squares with one signal as the input; None when it does not move."""
    u = data.values[name]
    span = float(np.nanquantile(u, 0.995) - np.nanquantile(u, 0.005))
    if span <= 0 or span <= 1e-6 * float(np.nanmax(np.abs(u))):
        return None
    zero = float(np.nanmedian(u))
    from scipy.optimize import lsq_linear

    x1, x2, good = _filtered(data, scaled, dt_s)
    slope = np.diff(x2) / np.diff(data.time_s)
    columns = [-_between(x2), -_between(x1), _between((u - zero) / span), np.ones(len(slope))]
    good = good & np.isfinite(slope) & np.isfinite(columns[2])
    matrix = np.column_stack(columns)[good]
    found = lsq_linear(matrix, slope[good], bounds=([_LEAST_ALPHA] * 2 + [-np.inf] * 2, np.inf)).x
    error = float(np.std(slope[good] - matrix @ found))
    seen = np.concatenate([[False], good]) & np.isfinite(u)
    sign = -1.0 if found[2] < 0 else 1.0  # alpha4 is positive by (4.20); an input that pushes back is turned round
    alpha4 = max(abs(float(found[2])), _LEAST_ALPHA)
    zero -= sign * span * float(found[3]) / alpha4
    return Calibration(
        name, scaled.zero, scaled.span, zero, sign * span, float(found[0]), alpha4, float(found[1]),
        b1=max(error, 1e-9), noise=scaled.noise, jerk=scaled.jerk, dt_s=dt_s, error=error,
        top_speed=_top(x2[seen]), top_position=_top(x1[seen]), top_input=_top((u[seen] - zero) / span),
    )  # fmt: skip


def _top(row: Array) -> float:
    """The largest size of a signal (n_samples,)."""
    return max(float(np.quantile(np.abs(row), _TOP)), 1e-6)


def _filtered(data: Measurements, scaled: _Scaled, dt_s: float) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Position and velocity behind the filter, and which intervals between samples can be used."""
    velocity = SteadyKalman(scaled.noise, scaled.jerk, dt_s)
    step = np.concatenate([[0.0], np.diff(data.time_s)])
    finite = np.isfinite(scaled.x1)
    step[~finite] = np.nan
    step[step > GAP_SAMPLES * dt_s] = 0.0
    _, x1, x2 = velocity.run(velocity.start(), step, scaled.x1, scaled.x1)
    since = np.arange(len(step)) - np.maximum.accumulate(np.where(step == 0.0, np.arange(len(step)), 0))
    good = finite & (since > SETTLE_SAMPLES)
    return x1, x2, good[1:] & good[:-1]


def _likely_jerk(scaled: _Scaled, dt_s: float) -> float:
    """The jerk under which the filter's one-step errors are likeliest, with the noise known."""
    x1 = scaled.x1[np.isfinite(scaled.x1)][:20_000]
    return float(min(_JERKS, key=lambda jerk: negative_log_likelihood(scaled.noise, jerk, dt_s, x1)))


def _between(row: Array) -> Array:
    return 0.5 * (row[1:] + row[:-1])
