"""Where what drives a valve is held, and the steps from one held value to the next."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.data.noise import noise_std
from identification.standard_tests.run import ValveRun
from recordings import Array

SHORTEST = 5
"""Samples that a held value has at least."""
SMALLEST = 1e-3
"""A step is no smaller than this share of the range of the input."""


@dataclass(frozen=True)
class HeldStep:
    """A step of the input between two held values.

    before, start, end : the samples ``before:start`` hold the old value and ``start:end`` the new one;
    source, target : the two values, in the unit of the input.
    """

    before: int
    start: int
    end: int
    source: float
    target: float

    @property
    def size(self) -> float:
        """Target minus source."""
        return self.target - self.source


def held_steps(run: ValveRun) -> list[HeldStep]:
    """The steps of a run's input; empty where it is never held, as in a ramp."""
    assert run.driven is not None
    edges, noise = _edges(run.driven), noise_std(run.driven)
    held = [(a, b) for a, b in pairwise(edges) if b - a >= SHORTEST and _is_held(run.driven, a, b, noise)]
    if sum(b - a for a, b in held) < 0.5 * len(run.driven):
        return []
    levels = [float(np.median(run.driven[a:b])) for a, b in held]
    smallest = SMALLEST * float(np.ptp(run.driven))
    return [
        HeldStep(a, b, d, levels[i], levels[i + 1])
        for i, ((a, b), (_, d)) in enumerate(pairwise(held))
        if abs(levels[i + 1] - levels[i]) > smallest
    ]


def _is_held(values: Array, start: int, end: int, noise: float) -> bool:
    """Whether the input stays within its noise, or within the smallest step, from the first third to the last."""
    third = max(1, (end - start) // 3)
    drift = abs(float(np.mean(values[end - third : end]) - np.mean(values[start : start + third])))
    return drift <= max(SMALLEST * float(np.ptp(values)), 4.0 * noise / float(np.sqrt(third / 2)))


def _edges(values: Array) -> list[int]:
    """Where the input changes by more than its noise, with both ends, as indices of the first changed sample."""
    change = np.abs(np.diff(values))
    usual = 1.4826 * float(np.median(change))
    level = max(8.0 * usual, 0.5 * SMALLEST * float(np.ptp(values)))
    return [0, *(int(i) + 1 for i in np.flatnonzero(change > level)), len(values)]
