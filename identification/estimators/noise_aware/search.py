"""The search of a noise-aware fit: descents on chunks of the recordings, the best of their ends on all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.budget import time_is_over
from identification.data.chunks import centred
from identification.data.grid import Grid
from identification.estimators.estimate import HOPELESS, Estimate, lean
from identification.estimators.noise_aware.best_paths import LAST, WORTH, BestPathsNoiseAware
from recordings import Array, Progress, silent

CHUNK, CHUNK_S, CHUNKS = 1000, 8.0, 6
"""Least nodes and seconds of a chunk, and number of chunks of all recordings together, about: in short ones paths make
up for what a model lacks."""
RIGHT = 1.06
"""Mean loss on chunks up to which an end is taken to be the right one at once: wrong ends have 1.1 to 15."""
UNEXPLAINED, NOT_FAR = 3.0, 2.0
"""Mean loss from which the model is known to lack much, and how many times the least loss is not far behind it."""
VAIN = 3
"""Descents in a row that end no better, or explain nothing (`UNEXPLAINED`), after which no more are made: where the
model lacks nothing the best end hardly comes later."""
FEW = 1e-3
"""Share of innovations far off from which an end on chunks is not taken for the right one."""
ROUNDS = 5
"""Times at most that a fit to whole recordings goes on."""
HIGHER = (1.0, 1.01, 1.05)
"""Factors on static friction with which a descent on whole recordings begins again."""
ROUGHER = 100.0
"""Factor on the intensity of what drives a rougher force: ten times are too few where the motion itself drives the
force, as behind a positioner."""
MUCH = 0.5
"""Share of the loss above 1 that a descent leaves, from which on the next one is not worth its time: what a model
lacks no descent finds."""
TOO_LONG = 1.5
"""Times that a sub-step may be longer than the end of the fit asks for: the error of a step grows with its square."""
ASIDE, NO_WORSE = 10.0, 60.0
"""Standard deviations by which a start is on the side of an end that may not be the best, and difference of the cost up
to which ends explain about as much.
"""
SAME = 1e-2
"""Distance of two starts, in coordinates, below which they are one."""
NEAR = 2.0
"""Mean loss along new paths up to which a descent begins before other starts are looked at."""


def best_on_chunks(
    whole: BestPathsNoiseAware, starts: Iterable[Array], enough: Callable[[Estimate], bool], progress: Progress = silent
) -> Estimate | None:
    """The best end on chunks from starting values (m,), the likeliest first, until it is enough or explains them. None
    where the model diverges from all.
    """
    small = replace(whole.coarse, grids=chunks(whole.grids))
    ends, vain = list[Estimate](), 0
    for tries, start in enumerate(_likeliest_first(small, starts), 1):
        progress("search on chunks", tries, 0)
        least = min((end.loss for end in ends), default=UNEXPLAINED)
        end = small.descended(small.mended(start), most=min(UNEXPLAINED, NOT_FAR * least))
        again = small.start(end.theta) if enough(end) else None
        if again is not None:  # what damped steps leave is no reason to stop where they are not needed
            end = small.descended(again)
        ends.append(end)
        best = _best(ends)
        vain = 0 if end is best and end.loss < UNEXPLAINED else vain + 1
        if vain == VAIN or _explained(best) or _agreed(ends) or enough(best) or time_is_over():
            break
    return _best(ends) if ends else None


def _likeliest_first(work: BestPathsNoiseAware, starts: Iterable[Array]) -> Iterator[Estimate]:
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
    """An end of a fit to whole recordings. work : what makes it; end : its estimate; is_root : whether steps along new
    paths came to a root there; others : ends that explain about as much.
    """

    work: BestPathsNoiseAware
    end: Estimate
    is_root: bool = False
    others: tuple[Estimate, ...] = ()

    @property
    def explains(self) -> bool:
        """Whether steps have come to an end, and its innovations look like noise."""
        return self.end.settled and self.work.explains(self.end)

    @property
    def to_others(self) -> Array:
        """How far the ends are that explain about as much (m,), in coordinates, at most."""
        return np.max([np.abs(one.theta - self.end.theta) for one in (self.end, *self.others)], axis=0)

    @property
    def to_rougher(self) -> Array:
        """How far the next step goes (m,), in coordinates, if the force is rougher between samples; 0 where the model
        diverges then, and where samples are so close that they show the force.
        """
        if not self.work.kernel.damped:
            return np.zeros_like(self.end.theta)
        move = with_rougher_force(self.work, self.end.theta)
        return np.zeros_like(self.end.theta) if move is None else move


def on_whole_recordings(whole: BestPathsNoiseAware, chunks_end: Estimate) -> WholeFit | None:
    """The fit to whole recordings from an end on chunks. None where the model diverges.

    Where steps along new paths explain too little, descents go on while they gain, from new paths and more static
    friction: chunks do not always tell it. A model that does not explain them has no root to which such steps lead, and
    says nothing of static friction: it is only descended.
    """
    start = whole.start(chunks_end.theta)
    if start is None:
        return None
    explained = chunks_end.loss < RIGHT
    fit = _followed if explained else _descended
    found = fit(whole, start)
    finer = whole.resolving(found.end.theta)
    start = finer.start(found.end.theta) if finer.freedom.h_max < whole.freedom.h_max / TOO_LONG else None
    if start is not None:
        found = fit(finer, start)
    for _ in range(ROUNDS):
        if found.explains or found.end.loss > HOPELESS or time_is_over():
            break
        start = _again(found, HIGHER if explained else HIGHER[:1])
        further = None if start is None else _descended(found.work, start)
        if further is None or further.end.cost > found.end.cost:
            break
        last = found.end.cost - further.end.cost < WORTH or further.end.loss - 1 > MUCH * (found.end.loss - 1)
        found = further
        if found.explains:
            followed = _followed(found.work, found.end)
            found = followed if followed.explains else found
        if last:
            break
    return found


def _followed(work: BestPathsNoiseAware, start: Estimate) -> WholeFit:
    return WholeFit(work, *work.followed(start))


def _descended(work: BestPathsNoiseAware, start: Estimate) -> WholeFit:
    return WholeFit(work, work.descend(start, LAST))


def from_both_sides(found: WholeFit) -> WholeFit:
    """The best of an end that is no root and of those to which steps from either side of it lead, and so from there,
    while that gains. A descent may stop in a hollow of its own paths.
    """
    work, ends = found.work, [found.end]
    for _ in range(ROUNDS):
        best = _best(ends)
        starts = [work.start(theta) for theta in _sides(work, best)]
        further = [_followed(work, start) for start in starts if start is not None and not time_is_over()]
        ends += [one.end for one in further if one.explains]
        before, best = best, _best(ends)
        ends = [best, *(lean(end) for end in ends if end is not best)]
        if best.cost > before.cost - WORTH:
            break
    return replace(found, end=ends[0], others=tuple(end for end in ends[1:] if end.cost < ends[0].cost + NO_WORSE))


def _sides(work: BestPathsNoiseAware, end: Estimate) -> list[Array]:
    """Parameters (m,) on either side of an estimate, with another mass, which the sampling tells least, and the others
    as the data want them then. None where the mass is given.
    """
    if "mass.m" not in work.names:
        return []
    i = work.names.index("mass.m")
    way = ASIDE * end.covariance[:, i] / np.sqrt(end.covariance[i, i])
    return [work.coordinates.bounds.nearest(end.theta + side * way) for side in (-1, 1)]


def _again(found: WholeFit, factors: Sequence[float]) -> Estimate | None:
    """The estimate from which a fit goes on that explains too little: along new paths where it has ended, or with so
    many times the static friction, whichever costs least. Where that is too low the model slips before the data do, and
    no step of a descent is as long as the way back. None where the model diverges.
    """
    work, theta = found.work, found.end.theta
    values = work.coordinates.values(theta)
    tried = [work.coordinates.theta_of(values | {"lugre.fs": factor * values["lugre.fs"]}) for factor in factors]
    starts = [start for start in map(work.start, tried) if start is not None]
    return min(starts, key=lambda start: start.cost, default=None)


def with_rougher_force(whole: BestPathsNoiseAware, theta: Array) -> Array | None:
    """The next step (m,) from the end of a fit if what drives the force is `ROUGHER` times as strong: there fewer slips
    decide. None where the model diverges.
    """
    grids = [replace(grid, force=replace(grid.force, intensity=ROUGHER * grid.force.intensity)) for grid in whole.grids]
    work = replace(whole, grids=grids)
    start = work.start(theta)  # paths that came to rest under the smooth force stay there
    return None if start is None else work.step(start)


def chunks(grids: Sequence[Grid]) -> list[Grid]:
    """Some stretches of every grid (n_samples,), evenly spread, when grids are long."""
    return [grids[i].part(at.start, at.stop) for i, at in chunk_places(grids)]


def chunk_places(grids: Sequence[Grid]) -> list[tuple[int, slice]]:
    """Where those stretches are: the number of the grid of each, and its nodes."""
    total, found = sum(len(s.t) for s in grids), list[tuple[int, slice]]()
    for i, s in enumerate(grids):
        n, count = len(s.t), max(1, round(CHUNKS * len(s.t) / total))
        length = max(CHUNK, int(CHUNK_S * (n - 1) / (s.t[-1] - s.t[0])))
        short = 1.5 * length * count >= n
        found += [(i, at) for at in ([slice(0, n)] if short else centred(n, length, count))]
    return found
