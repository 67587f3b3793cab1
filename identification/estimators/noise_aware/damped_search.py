"""The search of a fit in damped order: descents on chunks of the recordings, the best of their ends on all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.budget import time_is_over
from identification.estimators.estimate import HOPELESS, Estimate, converged
from identification.estimators.noise_aware.damped import LAST, DampedNoiseAware
from identification.estimators.noise_aware.search import HOPELESS_TRIES, NOT_FAR, RIGHT, UNEXPLAINED, chunks
from recordings import Array, Progress, silent

FEW = 1e-3
"""Share of innovations far off from which an end on chunks is not taken for the right one."""
ROUNDS = 5
"""Times at most that a fit to whole recordings goes on."""
HIGHER = (1.0, 1.01, 1.05)
"""Factors on static friction with which a descent on whole recordings begins again."""
ROUGHER = 100.0
"""Factor on the intensity of what drives a rougher force: ten times are too few where the motion itself drives the
force, as behind a positioner."""
WORTH = 30.0
"""Fall of the cost that paths of other slips give: a descent that gains less is the last."""
MUCH = 0.5
"""Share of the loss above 1 that a descent leaves, from which on the next one is not worth its time: what a model
lacks no descent finds."""
TOO_LONG = 1.5
"""Times that a sub-step may be longer than the end of the fit asks for: the error of a step grows with its square."""
SAME = 1e-2
"""Distance of two starts, in coordinates, below which they are one."""
NEAR = 2.0
"""Mean loss along new paths up to which a descent begins before other starts are looked at."""
DAMPED_CHUNK = 1000, 8.0
"""Least nodes and seconds of a chunk: in short ones paths make up for what a model lacks."""


def best_on_chunks(
    whole: DampedNoiseAware, starts: Iterable[Array], enough: Callable[[Estimate], bool], progress: Progress = silent
) -> Estimate | None:
    """The best end on chunks from starting values (m,), the likeliest first, until it is enough or explains them. None
    where the model diverges from all.
    """
    small = replace(whole.coarse, grids=chunks(whole.grids, *DAMPED_CHUNK))
    ends = list[Estimate]()
    for tries, start in enumerate(_likeliest_first(small, starts), 1):
        progress("search on chunks", tries, 0)
        least = min((end.loss for end in ends), default=UNEXPLAINED)
        end = small.descended(small.mended(start), most=min(UNEXPLAINED, NOT_FAR * least))
        again = small.start(end.theta) if enough(end) else None
        if again is not None:  # what damped steps leave is no reason to stop where they are not needed
            end = small.descended(again)
        ends.append(end)
        hopeless = tries >= HOPELESS_TRIES and all(end.loss > UNEXPLAINED for end in ends)
        best = _best(ends)
        if hopeless or _explained(best) or _agreed(ends) or enough(best) or time_is_over():
            break
    return _best(ends) if ends else None


def _likeliest_first(work: DampedNoiseAware, starts: Iterable[Array]) -> Iterator[Estimate]:
    """The estimates along new paths at starting values (m,) that differ: each at once if it is near, the others at the
    end, those of least loss first, but what explains nothing as it comes.
    """
    tried, others = list[Array](), list[Estimate]()
    for start in starts:
        if any(np.abs(start - one).max() < SAME for one in tried):
            continue
        tried.append(start)
        new = work.along_new(start)
        if new is not None and new.loss < NEAR:
            yield new
        elif new is not None:
            others.append(new)
    yield from sorted(others, key=lambda new: min(new.loss, UNEXPLAINED))


def _best(ends: Sequence[Estimate]) -> Estimate:
    return min(ends, key=lambda end: end.cost)


def _agreed(ends: Sequence[Estimate]) -> bool:
    """Whether two descents from different starts, and none to a better end, led to about the same cost."""
    least = min(end.cost for end in ends)
    return sum(end.cost < least + WORTH and end.loss < UNEXPLAINED for end in ends) > 1


def _explained(end: Estimate) -> bool:
    """Whether an end explains the chunks."""
    return end.loss < RIGHT and end.outliers < FEW


@dataclass(frozen=True)
class WholeFit:
    """An end of a fit to whole recordings. work : what makes it; end : its estimate."""

    work: DampedNoiseAware
    end: Estimate

    @property
    def explains(self) -> bool:
        """Whether its innovations look like noise."""
        return converged(self.end, resolved=False)

    @property
    def to_rougher(self) -> Array:
        """How far the next step goes (m,), in coordinates, if the force is rougher between samples; 0 where the model
        diverges then.
        """
        move = with_rougher_force(self.work, self.end.theta)
        return np.zeros_like(self.end.theta) if move is None else move


def on_whole_recordings(whole: DampedNoiseAware, chunks_end: Estimate) -> WholeFit | None:
    """The fit to whole recordings from an end on chunks. None where the model diverges.

    Where steps along new paths explain too little, descents go on while they gain, from new paths and more static
    friction. A model that is known to lack much has no root to which such steps lead, and is only descended.
    """
    start = whole.start(chunks_end.theta)
    if start is None:
        return None
    end = _followed(whole, start) if chunks_end.loss < UNEXPLAINED else _end(whole, start)
    finer = None if end is None else whole.resolving(end.theta)
    if end is not None and finer is not None and finer.freedom.h_max < whole.freedom.h_max / TOO_LONG:
        whole, start = finer, finer.start(end.theta)
        end = None if start is None else _followed(whole, start)
    if end is None:
        return None
    found = WholeFit(whole, end)
    for _ in range(ROUNDS):
        if found.explains or found.end.loss > HOPELESS or time_is_over():
            break
        end = _end(whole, _again(found))
        if end is None or end.cost > found.end.cost:
            break
        last = found.end.cost - end.cost < WORTH or end.loss - 1 > MUCH * (found.end.loss - 1)
        found = WholeFit(whole, end)
        if found.explains:
            further = _followed(whole, end)
            if converged(further, resolved=False):
                found = WholeFit(whole, further)
        if last:
            break
    return found


def _followed(whole: DampedNoiseAware, start: Estimate) -> Estimate:
    """Where steps along new paths lead on whole recordings, along the last paths or new ones."""
    end = whole.mended(whole.followed(start))
    new = None if converged(end) else whole.start(end.theta)
    return replace(new, settled=end.settled) if new is not None and new.cost < end.cost else end


def _end(whole: DampedNoiseAware, start: Estimate | None) -> Estimate | None:
    """Where a descent on whole recordings from a start leads; None without a start."""
    return None if start is None else whole.descend(start, LAST)


def _again(found: WholeFit) -> Estimate | None:
    """The estimate from which a fit goes on that explains too little: along new paths where it has ended, or with more
    static friction, whichever costs least. Where that is too low the model slips before the data do, and no step of a
    descent is as long as the way back. Chunks do not always tell it. A fit that explains nothing says nothing of static
    friction. None where the model diverges.
    """
    work, theta = found.work, found.end.theta
    values = work.coordinates.values(theta)
    factors = HIGHER[:1] if found.end.loss > UNEXPLAINED else HIGHER
    tried = [work.coordinates.theta_of(values | {"lugre.fs": factor * values["lugre.fs"]}) for factor in factors]
    starts = [start for start in map(work.start, tried) if start is not None]
    return min(starts, key=lambda start: start.cost, default=None)


def with_rougher_force(whole: DampedNoiseAware, theta: Array) -> Array | None:
    """The next step (m,) from the end of a fit if what drives the force is `ROUGHER` times as strong: there fewer slips
    decide. None where the model diverges.
    """
    grids = [replace(grid, force=replace(grid.force, intensity=ROUGHER * grid.force.intensity)) for grid in whole.grids]
    work = replace(whole, grids=grids)
    start = work.start(theta)  # paths that came to rest under the smooth force stay there
    return None if start is None else work.step(start)
