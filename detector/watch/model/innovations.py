"""The innovation over a whole run, and which of its samples can be learned from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detector.measurements import Measurements
from detector.watch.model.filter import DIRECTIONS, ModelFilter, PredictionError
from recordings import Array

SKIPPED = 50
"""Samples after a start that are not learned from."""


@dataclass(frozen=True)
class FilterRun:
    """A run of the filter: value, variance (n_samples,); slope (n_samples, n_directions); fresh : just started, or
    at rest.
    """

    value: Array
    variance: Array
    slope: Array
    fresh: NDArray[np.bool_]


def evidence_of(value: Array, variance: Array, slope: Array) -> Array:
    """What innovations say of each direction of change, and of any other: (..., n_directions + 1).

    The derivative of the log-likelihood by the direction, which is all that the data say of a small change
    (Basseville and Nikiforov 1993, section 8.3); and the normalised innovation itself. value, variance (...,); slope
    (..., n_directions).
    """
    away = value / np.sqrt(variance)
    shown = slope / np.sqrt(variance)[..., None]
    return np.concatenate([shown * away[..., None], away[..., None]], axis=-1)


def innovations(filter: ModelFilter, data: Measurements) -> FilterRun:
    """The filter over data: restarted at gaps, and skipping what is missing."""
    found, fresh = list[PredictionError](), np.zeros(len(data), bool)
    state, since = None, 0
    gap = 5.0 * float(np.median(np.diff(data.time_s)))
    nothing = PredictionError(0.0, filter.position_noise**2, np.zeros(len(DIRECTIONS)))
    for i, moment in enumerate(data):
        if not np.isfinite(moment.values["position"] + filter.force(moment)):
            found.append(nothing)
            fresh[i] = True
            continue
        if state is None or moment.time_s - state.time_s > gap:
            state, since = filter.start(moment), 0
            found.append(nothing)
        else:
            state, one = filter.step(state, moment)
            found.append(one)
        since += 1
        fresh[i] = since <= SKIPPED or found[-1].resting
    return FilterRun(
        np.array([one.value for one in found]), np.array([one.variance for one in found]),
        np.array([one.slope for one in found]), fresh,
    )  # fmt: skip
