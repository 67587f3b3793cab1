"""What the tests for a change are set to: sizes, usual energy and limits, all from fault-free data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from detector.alarms.rates import Blocks, least_limit, strokes_of
from detector.measurements import Measurements
from detector.observer.calibration_fit import MARGIN
from detector.watch.cusum import ChangeTest, N
from detector.watch.model.filter import ModelFilter, PredictionError
from detector.watch.model.innovations import FilterRun, innovations
from detector.watch.model.tuning import tuned
from recordings import Array

LEAST_SIZES = (0.5, 0.1, 0.5)
"""Changes that are tested for: half of the friction, a tenth of the spring, a force of half the friction level."""


def learned_test(filter: ModelFilter, data: Measurements, per_month: float) -> tuple[ChangeTest, Array]:
    """Sizes, usual energy and limits on fault-free data; and the scores (n_samples, n_directions + 1) on them.

    filter : not tuned yet. Each half of the data is judged by the filter tuned on the other: on data that it was
    tuned on a filter looks better than it is.
    """
    half = len(data) // 2
    first, second = data[:half], data[half:]
    run = _joined(innovations(tuned(filter, second), first), innovations(tuned(filter, first), second))
    used = ~run.fresh
    usual = float(np.mean(np.minimum(run.value**2 / run.variance, 100.0)[used])) + 1e-12
    level, noise = max(filter.values["lugre.fc"], 1e-3), filter.force_noise
    noisy = 2.0 * np.array([noise / level, 0.0, noise])  # a change that drowns in the noise of the force is none
    sizes = np.maximum.reduce([np.array(LEAST_SIZES) * (1.0, 1.0, level), noisy, 2.0 * _wander(run, used)])
    test = ChangeTest(tuple(sizes.tolist()), usual, (1e12,) * (N + 1))
    sums = replayed(test, run)
    dt_s, strokes = float(np.median(np.diff(data.time_s))), strokes_of(data.values["position"])
    least = least_limit(dt_s, per_month / (2 * N + 1))
    wanted = [Blocks.of(row, dt_s, strokes).limit(per_month / (N + 1)) for row in sums.T]
    limits = np.maximum(np.maximum(wanted, MARGIN * sums.max(axis=0)), least)
    return replace(test, limits=tuple(limits.tolist())), sums / limits


def _joined(first: FilterRun, second: FilterRun) -> FilterRun:
    """One after the other."""
    names = ("value", "variance", "slope", "fresh")
    return FilterRun(*(np.concatenate([getattr(first, name), getattr(second, name)]) for name in names))


def replayed(test: ChangeTest, run: FilterRun) -> Array:
    """The sums of a test over a run, (n_samples, n_directions + 1); those of fresh samples are zero."""
    evidence, sums = test.start(), np.zeros((len(run.value), N + 1))
    limits = np.array(test.limits)
    for i in range(len(run.value)):
        if run.fresh[i]:
            continue
        seen = PredictionError(float(run.value[i]), float(run.variance[i]), run.slope[i])
        evidence = test.step(evidence, seen)
        sums[i] = test.scores(evidence) * limits
    return sums


def _wander(run: FilterRun, used: NDArray[np.bool_]) -> Array:
    """How far each direction seems to move without a fault: rms of its estimates over stretches of the data."""
    n, found = max(100, int(np.sum(used)) // 40), []
    value, weight, slope = run.value[used], 1.0 / run.variance[used], run.slope[used][:, :N]
    for first in range(0, len(value) - n + 1, n):
        part = slice(first, first + n)
        information = weight[part] @ slope[part] ** 2
        found.append((information, (weight * value)[part] @ slope[part]))
    if not found:
        return np.zeros(N)
    informations, scores = (np.array(row) for row in zip(*found, strict=True))
    heavy = informations > 0.1 * np.median(informations, axis=0)
    estimates = np.where(heavy, scores / np.maximum(informations, 1e-300), 0.0)
    return np.sqrt(np.mean(estimates**2, axis=0))
