"""Valve signature: force or pressure against travel, both ways.

Half the distance of the two lines is friction, their mean is spring and preload (terms of ANSI/ISA-75.25.01-2000 and
ISA-TR75.25.02-2000). The mean line is quasi-static: speeds must be low, and inertia is neglected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from identification.standard_tests.dead_band import branch_at, sweep_turns
from identification.standard_tests.interval import Interval
from identification.standard_tests.plateaus import held_steps
from identification.standard_tests.run import ValveRun, run_of
from identification.standard_tests.stops import stops_of
from recordings import Array, BadInput, Recording

BINS = 20
"""Places along the stroke."""
EDGE = 0.1
"""Share of the travel at either end that is left out of the lines: the stem turns or meets a stop there."""
PASCAL = 1e-3
"""kPa in a Pa."""


@dataclass(frozen=True)
class SignatureLines:
    """The two lines on common positions (k,) [% of span]: rising and falling, in N or Pa, and the mean slope's sign."""

    place: Array
    up: Array
    down: Array

    @property
    def mean(self) -> Array:
        """The line without friction."""
        return (self.up + self.down) / 2

    @property
    def half(self) -> Array:
        """Friction along the stroke."""
        return np.abs(self.up - self.down) / 2


def signature_values(recordings: Sequence[Recording], problems: list[str]) -> dict[str, Any]:
    """Friction, spring rate, bench set, preload, seat load, stops and width along the stroke. Raises BadInput."""
    runs = [run_of(_with_input(one), ("pressure", "force")) for one in recordings]
    area, stroke = recordings[0].plant.diaphragm_area_m2, runs[0].stroke_m
    lines = [lines_of(run) for run in runs]
    by_pressure = runs[0].driver == "pressure"
    if any(run.driver != runs[0].driver for run in runs):
        raise BadInput(runs[0].name, "some recordings have a pressure and others a force", "test those of a kind alone")
    values = _in_input(lines, by_pressure)
    newton = area if by_pressure else 1.0
    if newton is None:
        problems.append("the diaphragm area is not known (diaphragm_area_m2 of the plant): no force is given")
    else:
        values |= _in_newton(lines, runs[0], newton, stroke, problems)
    if not by_pressure and area:
        low, high = _ends(lines)
        values["bench_set_kPa"] = [low.scaled(PASCAL / area), high.scaled(PASCAL / area)]
    travel = [float(np.min(runs[0].position)), float(np.max(runs[0].position))]
    values["travel_percent"] = travel
    (slope, offset), _ = _line(lines)
    for run, line in zip(runs, lines, strict=True):
        values |= stops_of(run, slope, offset, line.half)
    return values


def _with_input(recording: Recording) -> Recording:
    if "pressure" in recording or "force" in recording:
        return recording
    found = "it has neither a pressure nor a force"
    raise BadInput(recording.label, found, "a signature is pressure or force against travel: record one of them")


def lines_of(run: ValveRun) -> SignatureLines:
    """The two lines of a run. Raises BadInput where the stem did not go both ways over the same part of the stroke."""
    assert run.driven is not None
    run = _at_rest(run)
    assert run.driven is not None
    turns = sweep_turns(run.position)
    low, high = np.quantile(run.position, (0.01, 0.99))
    place = np.linspace(low + EDGE * (high - low), high - EDGE * (high - low), BINS)
    sides: dict[int, list[Array]] = {1: [], -1: []}
    for a, b in pairwise(turns):
        if b - a >= 4:
            side = 1 if run.position[b] > run.position[a] else -1
            sides[side].append(_smoothed_at(place, run.position[a : b + 1], run.driven[a : b + 1]))
    if sides[1] and sides[-1]:
        up, down = (_mean(sides[side]) for side in (1, -1))
        both = np.isfinite(up) & np.isfinite(down)
        if int(both.sum()) >= 5:
            return SignatureLines(place[both], up[both], down[both])
    found = "the stem did not go both ways over the same part of the stroke"
    raise BadInput(run.name, found, "record a slow stroke up and down")


def _at_rest(run: ValveRun) -> ValveRun:
    """Of an input that is held, the ends of the held values: between them the stem lags. A swept input stays."""
    steps = held_steps(run)
    if not steps:
        return run
    assert run.driven is not None
    ends = np.array([steps[0].start - 1, *(step.end - 1 for step in steps)])
    return replace(run, t=run.t[ends], position=run.position[ends], driven=run.driven[ends])


def _mean(strokes: Sequence[Array]) -> Array:
    table = np.array(strokes)
    known = np.isfinite(table)
    total = np.where(known, table, 0.0).sum(axis=0)
    return np.where(known.any(axis=0), total / np.maximum(known.sum(axis=0), 1), np.nan)


def _smoothed_at(place: Array, position: Array, driven: Array) -> Array:
    """The input at the places: the mean of the samples around each, else interpolated."""
    width = place[1] - place[0]
    answer = branch_at(place, position, driven)
    for i, x in enumerate(place):
        near = np.abs(position - x) < width / 2
        if int(near.sum()) >= 8 and np.isfinite(answer[i]):  # a line through the samples, at the place itself
            slope, offset = np.polyfit(position[near] - x, driven[near], 1) if np.ptp(position[near]) else (0, 0)
            answer[i] = offset if slope else float(np.mean(driven[near]))
    return answer


def _in_input(lines: Sequence[SignatureLines], by_pressure: bool) -> dict[str, Any]:
    """What needs no area: friction and bench set in kPa, the width along the stroke."""
    width = [[float(x), float(w)] for one in lines for x, w in zip(one.place, 2 * one.half, strict=True)]
    if not by_pressure:
        return {"width_N": width}
    low, high = _ends(lines)
    values: dict[str, Any] = {
        "friction_kPa": _friction(lines).scaled(PASCAL),
        "bench_set_kPa": [low.scaled(PASCAL), high.scaled(PASCAL)],
        "width_kPa": [[x, w * PASCAL] for x, w in width],
    }
    span = abs(high.value - low.value)
    if span > 0:
        values["width_percent_of_bench_set"] = _friction(lines).scaled(200.0 / span)
    return values


def _in_newton(
    lines: Sequence[SignatureLines], run: ValveRun, newton: float, stroke: float | None, problems: list[str]
) -> dict[str, Any]:
    """What a force says; `newton` : N in one unit of the input."""
    low, _ = _ends(lines)
    values: dict[str, Any] = {"friction_N": _friction(lines).scaled(newton), "preload_N": low.scaled(newton)}
    if stroke is None:
        problems.append("the stroke is not known (stroke_m of the plant): no spring rate is given")
    else:
        values["spring_rate_N_per_m"] = _slope(lines).scaled(100.0 * newton / stroke)
    assert run.driven is not None
    closed = run.position <= float(np.min(run.position)) + 3 * run.noise + 1e-9
    if int(closed.sum()) >= 3 and float(np.min(run.position)) < 1.0:
        least = float(np.min(run.driven[closed]))
        values["seat_load_N"] = Interval(*(end - least for end in (low.value, low.lower, low.upper))).scaled(newton)
    return values


def _friction(lines: Sequence[SignatureLines]) -> Interval:
    """Mean friction along the stroke."""
    half = np.concatenate([one.half for one in lines])
    return Interval.about(float(np.mean(half)), _error_of_mean(half))


def _error_of_mean(values: Array) -> float:
    """Standard error of the mean of neighbours that resemble each other (first-order autocorrelation)."""
    rest = values - np.mean(values)
    power = float(np.sum(rest**2))
    alike = float(np.clip(np.sum(rest[1:] * rest[:-1]) / power, 0.0, 0.9)) if power > 0 else 0.0
    independent = max(2.0, len(values) * (1 - alike) / (1 + alike))
    return float(np.std(values, ddof=1) / np.sqrt(independent))


def _line(lines: Sequence[SignatureLines]) -> tuple[Array, Array]:
    """The straight line through all mean lines: coefficients (slope, offset at 0 %) and their covariance."""
    x, y = (np.concatenate(parts) for parts in ([one.place for one in lines], [one.mean for one in lines]))
    design = np.column_stack([x, np.ones_like(x)])
    found, *_ = np.linalg.lstsq(design, y, rcond=None)
    rest = y - design @ found
    power = float(np.sum(rest**2))
    alike = float(np.clip(np.sum(rest[1:] * rest[:-1]) / power, 0.0, 0.9)) if power > 0 else 0.0
    variance = power / max(1, len(x) - 2) * (1 + alike) / (1 - alike)
    return np.asarray(found, float), np.asarray(variance * np.linalg.inv(design.T @ design), float)


def _slope(lines: Sequence[SignatureLines]) -> Interval:
    """Slope of the mean line per % of span, positive whichever way the spring acts."""
    found, covariance = _line(lines)
    slope = Interval.about(float(found[0]), float(np.sqrt(covariance[0, 0])))
    return slope if slope.value >= 0 else slope.scaled(-1.0)


def _ends(lines: Sequence[SignatureLines]) -> tuple[Interval, Interval]:
    """The mean line at 0 % and at 100 % of the span: the bench set."""
    found, covariance = _line(lines)

    def at(x: float) -> Interval:
        row = np.array([x, 1.0])
        return Interval.about(float(row @ found), float(np.sqrt(row @ covariance @ row)))

    return at(0.0), at(100.0)
