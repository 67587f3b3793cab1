"""The search of a fit in damped order: descents on chunks of the recordings, the best of their ends on all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from identification.budget import time_is_over
from identification.estimators.estimate import HOPELESS, Estimate
from identification.estimators.noise_aware.damped import LAST, DampedNoiseAware
from identification.estimators.noise_aware.search import HOPELESS_TRIES, NOT_FAR, RIGHT, UNEXPLAINED, chunks
from identification.estimators.order import critical_damping, usual_damping
from recordings import Array, Progress, silent

COARSER = 2
"""Times that a sub-step is longer on chunks: what that makes wrong, the descent on whole recordings mends."""
FEW = 1e-3
"""Share of innovations far off from which an end on chunks is not taken for the right one."""
DESCENTS = 4
"""Descents on whole recordings at most."""
HIGHER = (1.0, 1.01, 1.05)
"""Factors on static friction with which a descent on whole recordings begins again."""
CHUNK, CHUNK_S = 1000, 8.0
"""Least nodes and seconds of a chunk."""


def best_on_chunks(
    whole: DampedNoiseAware, starts: Iterable[Array], enough: Callable[[Estimate], bool], progress: Progress = silent
) -> Estimate | None:
    """The best end on chunks from starting values (m,), the likeliest first, until it is enough or explains them. None
    where the model diverges from all.
    """
    freedom = replace(whole.freedom, h_max=COARSER * whole.freedom.h_max)
    small = replace(whole, grids=chunks(whole.grids, CHUNK, CHUNK_S), freedom=freedom)
    ends = list[Estimate]()
    for tries, start in enumerate(starts, 1):
        progress("search on chunks", tries, 0)
        least = min((end.loss for end in ends), default=UNEXPLAINED)
        end = small.on_new_paths(start, most=min(UNEXPLAINED, NOT_FAR * least))
        if end is not None and enough(end):  # what damped steps leave is no reason to stop where they are not needed
            end = small.on_new_paths(end.theta)
        ends += [] if end is None else [end]
        hopeless = tries >= HOPELESS_TRIES and all(end.loss > UNEXPLAINED for end in ends)
        if ends and (hopeless or _explained(_best(ends)) or enough(_best(ends)) or time_is_over()):
            break
    return _best(ends) if ends else None


def _best(ends: Sequence[Estimate]) -> Estimate:
    return min(ends, key=lambda end: end.cost)


def _explained(end: Estimate) -> bool:
    """Whether an end explains the chunks."""
    return end.loss < RIGHT and end.outliers < FEW


def on_whole_recordings(
    whole: DampedNoiseAware, theta: Array, explains: Callable[[Estimate], bool]
) -> tuple[Estimate | None, bool]:
    """The fit to whole recordings from theta (m,), and whether it explains them; where it does not, once more from
    there, along new paths, or from more static friction. None where the model diverges.
    """
    found, good = None, False
    start = whole.start(theta)
    for _ in range(DESCENTS):
        end = _end(whole, start)
        if end is not None and (found is None or end.cost < found.cost):
            found, good = end, explains(end)
        if found is None or good or found.loss > HOPELESS or np.array_equal(found.theta, theta) or time_is_over():
            break
        theta = found.theta
        start = _again(whole, found)
    if found is None or not good:
        return found, good
    other = _less_damped(whole, found)
    return (found, good) if other is None or other.cost >= found.cost else (other, explains(other))


def _end(whole: DampedNoiseAware, start: Estimate | None) -> Estimate | None:
    """Where a descent on whole recordings from a start leads, as ends are compared; None without a start."""
    return None if start is None else whole.strict(whole.descend(start, LAST))


def _again(whole: DampedNoiseAware, found: Estimate) -> Estimate | None:
    """The best estimate about new paths where a fit has ended, or with more static friction: where that is too low the
    model slips before the data do, and no step of a descent is as long as the way back. Chunks do not always tell it. A
    fit that explains nothing says nothing of static friction.
    """
    values = whole.coordinates.values(found.theta)
    factors = HIGHER if found.loss < UNEXPLAINED else HIGHER[:1]
    tried = (whole.coordinates.theta_of(values | {"lugre.fs": factor * values["lugre.fs"]}) for factor in factors)
    starts = [start for start in map(whole.start, tried) if start is not None]
    return min(starts, key=lambda start: start.cost, default=None)


def _less_damped(whole: DampedNoiseAware, found: Estimate) -> Estimate | None:
    """The end of a descent from usual damping of the bristle and half the Stribeck velocity; None where a fit has not
    ended with overdamped bristles. There the cost has a second minimum, of little more: damping takes the place of the
    Stribeck curve.
    """
    values = whole.coordinates.values(found.theta)
    sigma0, m = values["lugre.sigma0"], values["mass.m"]
    if values["lugre.sigma1"] < critical_damping(sigma0, m) or time_is_over():
        return None
    other = values | {"lugre.sigma1": usual_damping(sigma0, m), "lugre.vs": 0.5 * values["lugre.vs"]}
    return _end(whole, whole.start(whole.coordinates.theta_of(other)))
