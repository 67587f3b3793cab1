"""From a loop to what the methods look at: about thirty samples a cycle, without mean and trend, scaled."""

from __future__ import annotations

import numpy as np

from identification.loops.loop import ControlLoop, averaged, scale_of
from identification.loops.methods import Cycles
from recordings import Array

PER_CYCLE = 30
"""Samples a cycle that are enough for every method; more are averaged, which takes noise away."""


def prepared(loop: ControlLoop, period_s: float) -> Cycles:
    """The loop made ready for the methods, with the period of its strongest oscillation."""
    period = period_s / loop.dt
    every = max(1, round(period / PER_CYCLE))
    pv, op, error = (averaged(values, every) for values in (loop.pv, loop.op, loop.error))
    pv, op, error = (values - _slow(values, max(3, int(4 * period / every))) for values in (pv, op, error))
    return Cycles(
        (pv - np.mean(pv)) / scale_of(pv), (op - np.mean(op)) / scale_of(loop.op), error / scale_of(error),
        period / every, loop.integrating, loop.kind == "flow",
        loop.kind == "pressure",
    )  # fmt: skip


def _slow(values: Array, width: int) -> Array:
    """What is slower than some cycles: the signal's moving mean, taken over whole windows as far as it has them."""
    if width >= len(values):
        return np.full(len(values), float(np.mean(values)))
    total = np.concatenate([[0.0], np.cumsum(values)])
    middle = np.arange(len(values))
    start = np.clip(middle - width // 2, 0, len(values) - width)
    return np.asarray((total[start + width] - total[start]) / width, float)
