"""A control loop as a historian has it: set point, process value and controller output on one clock."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from recordings import Array, BadInput

LoopKind = Literal["flow", "pressure", "level", "temperature"]
LOOP_KINDS: tuple[LoopKind, ...] = get_args(LoopKind)

FEWEST = 60
"""Samples below which nothing is judged."""
MIXED = 0.05
"""Share of sampling intervals that may differ from the usual one before the sampling counts as mixed."""


@dataclass(frozen=True)
class ControlLoop:
    """One loop, arrays (n,), evenly sampled. name : for messages; dt : s; sp : None where it was not recorded;
    op_percent : whether OP is in % of its range; kind : None where it is not known; gaps : stretches left out;
    missing : share of samples without a number.
    """

    name: str
    dt: float
    sp: Array | None
    pv: Array
    op: Array
    op_percent: bool
    kind: LoopKind | None
    gaps: int = 0
    missing: float = 0.0

    @property
    def integrating(self) -> bool:
        """Whether the process integrates: a level."""
        return self.kind == "level"

    @property
    def error(self) -> Array:
        """Set point minus process value, (n,), without its mean."""
        error = (0.0 if self.sp is None else self.sp) - self.pv
        return np.asarray(error - np.mean(error), float)


def averaged(values: Array, every: int) -> Array:
    """Means (n // every, ...) of `every` samples each of values (n, ...)."""
    whole = len(values) // every * every
    return np.asarray(values[:whole].reshape(-1, every, *values.shape[1:]).mean(axis=1), float)


def scale_of(values: Array) -> float:
    """The standard deviation, by which anything may be divided."""
    return max(float(np.std(values)), 1e-300)


def loop_of(
    name: str, t: Array, sp: Array | None, pv: Array, op: Array, op_percent: bool, kind: LoopKind | None
) -> ControlLoop:
    """The loop of columns (n,), its longest stretch without a gap. Raises BadInput for what cannot be judged."""
    back = np.flatnonzero(np.diff(t) <= 0)
    if len(back):
        found = f"the clock runs backwards or stands still at sample {int(back[0]) + 2}"
        raise BadInput(f"{name}: time", found, "sort the rows by time and leave out those that are there twice")
    good = np.isfinite(pv) & np.isfinite(op) & (True if sp is None else np.isfinite(sp))
    t, pv, op, sp = t[good], pv[good], op[good], None if sp is None else sp[good]
    _check_length(name, len(t))
    steps = np.diff(t)
    dt = float(np.median(steps))
    times = np.round(steps / dt)
    whole = (np.abs(steps / dt - times) < 0.2) & (times >= 1)
    if np.mean(~whole) > MIXED or np.mean(times > 1) > 0.2:
        low, high = np.quantile(steps, (0.05, 0.95))
        found = f"the sampling is mixed: intervals from {low:.4g} s to {high:.4g} s"
        raise BadInput(f"{name}: time", found, "export raw data at one sampling interval")
    edges = [0, *(int(i) + 1 for i in np.flatnonzero(steps > 1.5 * dt)), len(t)]
    a, b = max(pairwise(edges), key=lambda one: one[1] - one[0])
    _check_length(name, b - a)
    kept = (None if sp is None else sp[a:b], pv[a:b], op[a:b])
    loop = ControlLoop(name, dt, *kept, op_percent, kind, len(edges) - 2, float(np.mean(~good)))
    _check_signals(loop)
    return loop


def _check_length(name: str, n: int) -> None:
    if n < FEWEST:
        raise BadInput(name, f"{n} samples in a row have PV and OP", f"give at least {FEWEST}, and ten cycles")


def _check_signals(loop: ControlLoop) -> None:
    if np.ptp(loop.op) == 0.0:
        found = "the controller output OP never changes"
        raise BadInput(f"{loop.name}: OP", found, "give data of the loop in automatic mode; check which column is OP")
    if np.ptp(loop.pv) == 0.0:
        raise BadInput(f"{loop.name}: PV", "the process value PV never changes", "check which column is PV")
    if loop.sp is not None and np.allclose(loop.sp, loop.pv, rtol=0, atol=1e-9 * float(np.ptp(loop.pv))):
        raise BadInput(f"{loop.name}: PV", "the process value PV is a copy of the set point SP", "check the columns")
    if np.array_equal(loop.op, loop.pv):
        raise BadInput(f"{loop.name}: PV", "the process value PV is a copy of OP", "check the columns")
