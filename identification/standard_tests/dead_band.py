"""Dead band and resolution, in % of the input span.

ANSI/ISA-75.25.01-2000 (R2010) and EnTech 3.0: the dead band is the range through which the input can be varied, with a
reversal of its direction, without a change of the stem; the resolution is the smallest change of the input in the
direction of the last motion that moves the stem. IEC 61298-2:2008 has the same two by small steps up and down.

Steps bracket both: what the input had changed since the last motion without a response is below it, what moved the
stem is above it. An input that is swept and not held shows the distance of its two branches instead, which is dead band
and hysteresis together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from identification.standard_tests.interval import Interval
from identification.standard_tests.plateaus import HeldStep, held_steps
from identification.standard_tests.run import ValveRun
from recordings import Array, BadInput

MOVED = 5.0
"""The stem moved when its rest changed by more standard errors than this."""


@dataclass(frozen=True)
class Bracket:
    """One quantity between two changes of the input: the stem did not answer `below` and answered `above` [%]."""

    below: float
    above: float
    reversed: bool


def dead_band_values(runs: Sequence[ValveRun], problems: list[str]) -> dict[str, Any]:
    """Dead band and resolution. Raises BadInput where the recordings have neither held steps nor a sweep and back."""
    for run in runs:
        if run.driven is None or run.unit != "%":
            found = "there is neither a set point nor a drive signal"
            raise BadInput(run.name, found, "dead band and resolution are in % of the input span: record the set point")
    brackets: list[Bracket] = []
    widths: list[float] = []
    for run in runs:
        steps = held_steps(run)
        if steps:
            brackets += brackets_of(run, steps)
        else:
            widths += branch_distances(run)
    values: dict[str, Any] = {}
    if brackets:
        values["dead_band_percent"] = _joined([b for b in brackets if b.reversed])
        values["resolution_percent"] = _joined([b for b in brackets if not b.reversed])
        if values["dead_band_percent"] is None:
            problems.append("no step reversed the input and moved the stem: the dead band is not known")
        if values["resolution_percent"] is None:
            problems.append("no step in the direction of the last motion moved the stem: the resolution is not known")
    if widths:
        values["dead_band_and_hysteresis_percent"] = Interval.of_repeats(widths)
        values.setdefault("dead_band_percent", values["dead_band_and_hysteresis_percent"])
        problems.append("the input was swept: its two branches show dead band and hysteresis together")
    if not any(values.values()):
        found = "the input neither steps nor goes forth and back"
        raise BadInput(runs[0].name, found, "record small steps that are held, in both directions")
    return values


def brackets_of(run: ValveRun, steps: Sequence[HeldStep]) -> list[Bracket]:
    """What every motion of the stem says: by how much the input had changed since the last one."""
    found: list[Bracket] = []
    at, direction, silent = None, 0, 0.0
    for step in steps:
        if at is None:
            at = step.source
        change = _rest(run, step.start, step.end)[0] - _rest(run, step.before, step.start)[0]
        error = float(np.hypot(_rest(run, step.start, step.end)[1], _rest(run, step.before, step.start)[1]))
        asked = step.target - at
        if abs(change) <= MOVED * error or np.sign(change) != np.sign(asked) * gain_of(run):
            silent = asked if abs(asked) > abs(silent) or asked * silent < 0 else silent
            continue
        if direction:
            below = abs(silent) if silent * asked > 0 else 0.0
            found.append(Bracket(min(below, abs(asked)), abs(asked), int(np.sign(asked)) != direction))
        at, direction, silent = step.target, int(np.sign(asked)), 0.0
    return found


def gain_of(run: ValveRun) -> float:
    """Whether the stem follows the input or goes against it: 1 or -1."""
    assert run.driven is not None
    return 1.0 if np.cov(run.driven, run.position)[0, 1] >= 0 else -1.0


def _rest(run: ValveRun, start: int, end: int) -> tuple[float, float]:
    """Mean position at the end of a held value, and its standard error [%]."""
    tail = run.position[max(start, end - max(3, (end - start) // 3)) : end]
    return float(np.mean(tail)), max(run.noise / float(np.sqrt(len(tail))), 1e-9)


def _joined(found: Sequence[Bracket]) -> Interval | None:
    """The interval that brackets leave: where they overlap their common part, else from the median low to high end."""
    if not found:
        return None
    low, high = max(b.below for b in found), min(b.above for b in found)
    if low > high:
        low, high = (float(np.median(ends)) for ends in ([b.below for b in found], [b.above for b in found]))
    return Interval((low + high) / 2, low, high)


def branch_distances(run: ValveRun) -> list[float]:
    """Distance of rising and falling branch of a swept input at equal stem positions, every 5 % of the travel [%]."""
    assert run.driven is not None
    turn = sweep_turns(run.driven)
    sides: dict[int, list[tuple[Array, Array]]] = {1: [], -1: []}
    for a, b in pairwise(turn):
        if b - a >= 4:
            side = 1 if run.driven[b] > run.driven[a] else -1
            sides[side].append((run.position[a : b + 1], run.driven[a : b + 1]))
    if not sides[1] or not sides[-1]:
        return []
    low, high = np.quantile(run.position, (0.02, 0.98))
    grid = np.linspace(low + 0.15 * (high - low), high - 0.15 * (high - low), 15)
    up, down = (np.array([branch_at(grid, *one) for one in sides[side]]) for side in (1, -1))
    both = np.isfinite(up).any(axis=0) & np.isfinite(down).any(axis=0)
    distance = (np.nanmedian(up[:, both], axis=0) - np.nanmedian(down[:, both], axis=0)) * gain_of(run)
    return [float(d) for d in distance]


def branch_at(grid: Array, position: Array, driven: Array) -> Array:
    """The input at positions of the grid, NaN outside the branch."""
    order = np.argsort(position, kind="stable")
    return np.asarray(np.interp(grid, position[order], driven[order], left=np.nan, right=np.nan), float)


def sweep_turns(driven: Array) -> list[int]:
    """Indices of the ends and of the reversals of a sweep, those smaller than a tenth of its range left out."""
    least, turns, far, direction = 0.1 * float(np.ptp(driven)), [0], 0, 0
    for i, value in enumerate(driven):
        ahead = (value - driven[far]) * (direction or 1)
        if direction == 0 and abs(value - driven[0]) > least:
            direction, far = (1 if value > driven[0] else -1), i
        elif direction and ahead > 0:
            far = i
        elif direction and -ahead > least:
            turns.append(far)
            direction, far = -direction, i
    return [*turns, len(driven) - 1]
