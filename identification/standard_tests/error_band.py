"""Dynamic error band: by how much the stem of a moving valve differs from up to down, at equal inputs.

The input is swept slowly over most of its span and back. Hysteresis, dead band and the error that grows with the rate
show together (ANSI/ISA-51.1-1979 (R1993), Process Instrumentation Terminology, for the terms): the band is the mean
distance of the two lines, in % of span, beside its largest and its smallest distance. Linearity is the largest distance
of their mean line from the straight line that fits it best.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from identification.standard_tests.dead_band import branch_at, gain_of, sweep_turns
from identification.standard_tests.interval import Interval
from identification.standard_tests.plateaus import held_steps
from identification.standard_tests.run import ValveRun
from recordings import Array, BadInput

PLACES = 40
"""Inputs at which the lines are compared."""
ENDS = 0.05
"""Share of the sweep at each end that is left out: there the stem turns."""


def error_band_values(runs: Sequence[ValveRun], problems: list[str]) -> dict[str, Any]:
    """Dynamic error band, largest and smallest distance, linearity, rate. Raises BadInput where nothing is swept."""
    bands: list[float] = []
    most: list[float] = []
    least: list[float] = []
    bends: list[float] = []
    rates: list[float] = []
    for run in runs:
        if run.driven is None or run.unit != "%":
            found = "there is neither a set point nor a drive signal"
            raise BadInput(run.name, found, "the error band is in % of the input span: record the set point")
        if held_steps(run):
            problems.append(f"{run.name}: the input is held in steps, and an error band wants a sweep: left out")
            continue
        for up, down in _cycles(run):
            distance = (down - up) * gain_of(run)
            known = np.isfinite(distance)
            if int(known.sum()) < PLACES // 2:
                continue
            bands.append(float(np.mean(distance[known])))
            most.append(float(np.max(distance[known])))
            least.append(float(np.min(distance[known])))
            bends.append(_bend(0.5 * (up + down)[known]))
        rates.append(float(np.median(np.abs(np.gradient(run.driven, run.t)))))
    if not bands:
        raise BadInput(
            runs[0].name, "the input does not go forth and back", "sweep it slowly up and down, from 5 to 95 %"
        )
    noise = max(run.noise for run in runs)
    return {
        "dynamic_error_band_percent": Interval.of_repeats(bands, noise / np.sqrt(PLACES / 2)),
        "largest_error_percent": Interval.of_repeats(most, np.sqrt(2) * noise),
        "smallest_error_percent": Interval.of_repeats(least, np.sqrt(2) * noise),
        "dynamic_linearity_percent": Interval.of_repeats(bends, noise),
        "rate_percent_per_s": Interval.about(float(np.median(rates)), 0.0),
    }


def _cycles(run: ValveRun) -> list[tuple[Array, Array]]:
    """The stem on every rise of the input and on the fall that follows, at equal inputs (`PLACES`,), NaN outside."""
    assert run.driven is not None
    low, high = float(run.driven.min()), float(run.driven.max())
    grid = np.linspace(low + ENDS * (high - low), high - ENDS * (high - low), PLACES)
    sides = [
        (run.driven[b] > run.driven[a], branch_at(grid, run.driven[a : b + 1], run.position[a : b + 1]))
        for a, b in pairwise(sweep_turns(run.driven))
        if b - a >= 4
    ]
    return [(one, other) if up else (other, one) for (up, one), (then, other) in pairwise(sides) if up != then]


def _bend(middle: Array) -> float:
    """Largest distance of a line from the straight one that fits it best."""
    x = np.arange(float(len(middle)))
    return float(np.max(np.abs(middle - np.polyval(np.polyfit(x, middle, 1), x))))
