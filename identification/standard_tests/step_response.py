"""Step response: dead time, T63, T86, overshoot and settling of every step.

Terms of ANSI/ISA-75.25.01-2000 (R2010) and EnTech Control Valve Dynamic Specification 3.0 (1998): Td is the time from
the step of the input to the begin of motion; T63 and T86 are the times from the step of the input until 63.2 % and
86.5 % of the final change, Td included. Overshoot is in % of the final change. Settling is the last time outside a
band of 2 % of the final change, or of four noise levels where these are more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import curve_fit

from identification.standard_tests.interval import Interval
from identification.standard_tests.plateaus import HeldStep, held_steps
from identification.standard_tests.run import ValveRun
from recordings import Array, BadInput

SETTLED = 0.02
"""Band of settling, share of the final change."""
SEEN = 4.0
"""A step is judged when the stem moved by more noise levels than this."""
QUANTITIES = ("Td_s", "T63_s", "T86_s", "overshoot_percent", "settling_s")


def step_values(runs: Sequence[ValveRun], problems: list[str]) -> dict[str, Any]:
    """Every step, and the medians over all of them. Raises BadInput where no step can be judged."""
    steps = [found for run in runs for found in _steps(run, problems)]
    if not steps:
        found = "no step of the input moved the stem beyond its noise"
        raise BadInput(runs[0].name, found, "record steps that are held until the stem is at rest")
    return {**{name: _median([step[name] for step in steps if name in step]) for name in QUANTITIES}, "steps": steps}


def _median(found: Sequence[Interval]) -> Interval | None:
    """The median of steps; its interval covers what one step can be, not the mean of many."""
    if not found:
        return None
    return Interval(*(float(np.median([getattr(one, end) for one in found])) for end in ("value", "lower", "upper")))


def _steps(run: ValveRun, problems: list[str]) -> list[dict[str, Any]]:
    if run.driven is None:
        problems.append(f"{run.name}: nothing that drives the valve was recorded; times count from the first sample")
        return [_judged(run, HeldStep(0, 0, len(run.t), run.position[0], run.position[-1]), problems)]
    answers = []
    for step in held_steps(run):
        answer = _judged(run, step, problems)
        if answer:
            answers.append({"from": step.source, "to": step.target, "unit": run.unit, **answer})
    return answers


def _judged(run: ValveRun, step: HeldStep, problems: list[str]) -> dict[str, Any]:
    """The quantities of one step; empty where the stem did not move."""
    t, y = run.t[step.start : step.end] - run.t[step.start], run.position[step.start : step.end]
    rest = run.position[max(step.before, step.start - max(3, (step.start - step.before) // 4)) : max(1, step.start)]
    tail = y[-max(3, len(y) // 4) :]
    first, last = float(np.mean(rest)), float(np.mean(tail))
    noise = max(run.noise, 1e-9 * max(1.0, abs(last)))
    where = f"{run.name}: step at {run.t[step.start]:.6g} s"
    fitted = _first_order(t, y, first)
    if abs(last - first) < SEEN * noise or len(y) < FEWEST_OF_A_STEP:
        problems.append(f"{where}: the stem did not move beyond its noise, or was held for too few samples")
        return {}
    drift = abs(float(np.mean(tail[len(tail) // 2 :]) - np.mean(tail[: len(tail) // 2])))
    if drift > max(SETTLED * abs(last - first), 3 * noise / np.sqrt(len(tail) / 2)):
        problems.append(f"{where}: the stem was not at rest at its end; the final value is extrapolated")
        last = _limit(t, y, last)
    share, sigma = (y - first) / (last - first), noise / abs(last - first)
    spread = float(np.hypot(sigma / np.sqrt(len(tail)), sigma / np.sqrt(len(rest))))
    answer: dict[str, Any] = {"travel_percent": Interval.about(last - first, spread * abs(last - first))}
    answer["Td_s"] = _dead_time(t, share, sigma, run.dt)
    for name, level in (("T63_s", 1 - np.exp(-1.0)), ("T86_s", 1 - np.exp(-2.0))):
        crossing = _crossing(t, share, float(level), sigma, spread, run.dt)
        if crossing:
            answer[name] = crossing
    answer["overshoot_percent"] = _overshoot(share, sigma)
    answer["settling_s"] = _settling(t, share, sigma)
    if fitted:
        names = ("fitted_delay_s", "fitted_time_constant_s", "fitted_rmse_percent")
        answer |= dict(zip(names, fitted, strict=True))
    return {name: value for name, value in answer.items() if value is not None}


FEWEST_OF_A_STEP = 8


def _limit(t: Array, y: Array, last: float) -> float:
    """Where an exponential through the second half of a response ends; its last value where there is no such limit."""
    half = t >= (t[0] + t[-1]) / 2

    def model(t: Array, final: float, left: float, tau: float) -> Array:
        return final + left * np.exp(-(t - t[0]) / tau)

    span = float(t[-1] - t[0])
    bounds = ((-np.inf, -np.inf, 1e-3 * span), (np.inf, np.inf, span))
    try:
        found, _ = curve_fit(model, t[half], y[half], (last, y[half][0] - last, 0.25 * span), bounds=bounds)
    except (RuntimeError, ValueError, TypeError):
        return last
    return float(found[0])


def _dead_time(t: Array, share: Array, sigma: float, dt: float) -> Interval | None:
    """Begin of motion: the line through the first fifth of the response, back to rest."""
    level = max(3 * sigma, 0.01)
    upper = max(0.2, 2 * level)
    seen, far = _first_above(t, share, level), _first_above(t, share, upper)
    if seen is None or far is None:
        return None
    back = level / (upper - level) * max(far - seen, 0.0)
    value = float(np.clip(seen - back, 0.0, seen))
    half = 1.96 * float(np.hypot(back * sigma / level * 1.5, dt / np.sqrt(6)))
    return Interval(value, max(0.0, value - half), max(seen, value + half))


def _first_above(t: Array, share: Array, level: float) -> float | None:
    """First time from which two samples in a row are above a level, interpolated."""
    above = share > level
    both = np.flatnonzero(above[:-1] & above[1:])
    if not len(both):
        return None
    i = int(both[0])
    if i == 0:
        return float(t[0])
    part = (level - share[i - 1]) / (share[i] - share[i - 1])
    return float(t[i - 1] + np.clip(part, 0.0, 1.0) * (t[i] - t[i - 1]))


def _crossing(t: Array, share: Array, level: float, sigma: float, spread: float, dt: float) -> Interval | None:
    """Time of a level: the middle between its first and its last crossing on the way up, which noise sets apart."""
    first = _first_above(t, share, level)
    if first is None:
        return None
    beyond = _first_above(t, share, min(level + 4 * sigma + 0.05, 0.98)) or float(t[-1])
    below = np.flatnonzero((share < level) & (t <= beyond))
    last = float(t[below[-1]]) + dt / 2 if len(below) else first
    value = (first + max(first, last)) / 2
    low, high = _first_above(t, share, level - 0.1), _first_above(t, share, min(level + 0.1, 0.98))
    slope = 0.2 / max((high or beyond) - (low or 0.0), dt)
    std = float(np.sqrt((np.hypot(sigma, spread) / slope) ** 2 + dt**2 / 6))
    return Interval(value, max(0.0, value - 1.96 * std), value + 1.96 * std)


def _overshoot(share: Array, sigma: float) -> Interval:
    """The highest excess over the final value, less what the highest of so many noise values is expected to be."""
    excess, chance = float(np.max(share)) - 1.0, sigma * float(np.sqrt(2 * np.log(len(share))))
    return Interval(*(100 * max(0.0, excess - k * chance) for k in (1.0, 2.0, 0.0)))


def _settling(t: Array, share: Array, sigma: float) -> Interval:
    band = max(SETTLED, 4 * sigma)

    def last_outside(width: float) -> float:
        outside = np.flatnonzero(np.abs(share - 1) > width)
        return float(t[min(outside[-1] + 1, len(t) - 1)]) if len(outside) else 0.0

    return Interval(last_outside(band), last_outside(band + 2 * sigma), last_outside(max(band - 2 * sigma, band / 2)))


def _first_order(t: Array, y: Array, first: float) -> tuple[Interval, Interval, float] | None:
    """First order with delay, by least squares: delay [s], time constant [s] and what is left, % of the final change;
    None where it fails. Where the shape is another, errors of neighbouring samples are alike, and tell less.
    """

    def model(t: Array, final: float, delay: float, tau: float) -> Array:
        return first + (final - first) * -np.expm1(-np.maximum(t - delay, 0.0) / tau)

    span = max(float(t[-1]), 1e-9)
    start = (float(y[-1]), 0.05 * span, 0.2 * span)
    bounds = ((-np.inf, 0.0, 1e-4 * span), (np.inf, span, 10 * span))
    try:
        found, covariance = curve_fit(model, t, y, start, bounds=bounds, max_nfev=200)
    except (RuntimeError, ValueError):
        return None
    error = y - model(t, *found)
    alike = float(np.clip(error[1:] @ error[:-1] / max(float(error @ error), 1e-300), 0.0, 0.99))
    std = np.sqrt(np.diag(covariance) * (1 + alike) / (1 - alike))
    if not np.all(np.isfinite(std)):
        return None
    left = 100 * float(np.sqrt(np.mean(error**2)) / max(abs(found[0] - first), 1e-300))
    return Interval.about(float(found[1]), float(std[1])), Interval.about(float(found[2]), float(std[2])), left
