"""The search of a fit in damped order: descents on chunks of the recordings, the best of their ends on all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.budget import time_is_over
from identification.estimators.estimate import HOPELESS, Estimate, no_worse
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
WORTH = 30.0
"""Fall of the cost that paths of other slips give: a descent that gains less is the last of a fit that explains."""
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


@dataclass(frozen=True)
class WholeFit:
    """A fit to whole recordings. end : the best end of its descents; explains : whether that explains the recordings;
    apart (m,) : distance to another end that explains them as well, in coordinates, 0 where there is none.
    """

    end: Estimate
    explains: bool
    apart: Array

    @classmethod
    def of(cls, end: Estimate, explains: Callable[[Estimate], bool]) -> WholeFit:
        return cls(end, explains(end), np.zeros(len(end.theta)))

    def or_better(self, end: Estimate | None, explains: Callable[[Estimate], bool]) -> WholeFit:
        """The fit after one more descent, None where that diverged."""
        if end is None:
            return self
        better = end.cost < self.end.cost
        found = WholeFit.of(end, explains) if better else self
        other = self.end if better else end
        alike = found.explains and no_worse(other, found.end)
        return replace(found, apart=np.abs(end.theta - self.end.theta)) if alike else found


def on_whole_recordings(
    whole: DampedNoiseAware, theta: Array, explains: Callable[[Estimate], bool]
) -> WholeFit | None:  # fmt: skip
    """The fit to whole recordings from theta (m,). None where the model diverges.

    It begins again along new paths from its end while that gains, and from more static friction where it explains too
    little. Slips that paths miss move an end by more than noise does: how far, ends of about the same cost tell.
    """
    end = _end(whole, whole.start(theta))
    if end is None:
        return None
    found, fall = WholeFit.of(end, explains), np.inf
    for _ in range(DESCENTS - 1):
        if (found.explains and fall < WORTH) or found.end.loss > HOPELESS or time_is_over():
            break
        start = whole.start(found.end.theta) if found.explains else _again(whole, found.end)
        before, found = found.end, found.or_better(_end(whole, start), explains)
        fall = before.cost - found.end.cost
        if not found.explains and fall == 0.0:
            break
    return found.or_better(_less_damped(whole, found.end), explains) if found.explains else found


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
