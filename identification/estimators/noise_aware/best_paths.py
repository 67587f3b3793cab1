"""The noise-aware estimate of a fit: parameters along the best of several paths.

A slip lasts a few samples. A path that slips a sample late costs hundreds, at the right parameters as at others, and
hides what a step of the parameters gains. So the cost of parameters is that of the best of several paths, stretch
by stretch: along the smoothed motion, runs of the model, and those that were best before; about a slip that all miss,
runs that slip as the data do (`shots.py`). Steps are Gauss-Newton's.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.budget import time_is_over
from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import HOPELESS, Estimate, Innovations, converged, handed_over, lean
from identification.estimators.least_squares import Step, gauss_newton
from identification.estimators.noise_aware.estimator import LONGEST, NEW_PATH
from identification.estimators.noise_aware.linearised_model import PathFreedom
from identification.estimators.noise_aware.mending import MendedNoiseAware
from identification.estimators.noise_aware.paths import first_paths
from identification.estimators.noise_aware.resolution import quickest, resolved_by_nodes, resolving
from identification.estimators.noise_aware.stretches import stretch_costs, stretches, stretchwise
from identification.estimators.order import Order, sub_step
from identification.parallel import each
from recordings import Array
from simulator import Kernel, kernel

FREEDOM = PathFreedom(1.0, 1e-4, 0.1, 2.5e-4)
"""Freedom of the path; it makes up for what damped steps damp. In full order its sub-steps follow the bristle."""
FINER = 4
"""Part of the longest sub-step that resolves a slip which the fit takes: the step's own error biases mass and viscous
friction by more than the noise does (at full size by ten standard deviations, at a quarter by none that shows)."""
COARSER = 2
"""Times that a sub-step is longer on chunks: what that makes wrong, the fit to whole recordings mends."""
WORSE, BACK = 0.1, 0.3
"""Rise of the cost of a stretch from which a step of its path does harm, and the share of the step that is kept."""
STEPS, LAST = 6, 12
"""Steps by which a descent on chunks shows whether it is worth going on, and steps of it then and on whole recordings.
"""
LOOSE, LOOSE_STEPS = 5.0, 3
"""Factor on the noise of the force while a new path comes to rest at first, and steps of that."""
FOLLOWED, FEW, ENOUGH = 48, 8, 2.0
"""Steps along new paths at most, how many of them have to lower the mean cost of as many before them, and the fall of
the cost that another one has to promise."""
NOTABLE = 3e-3
"""The same as a share of what is left beside noise, where paths slip as the data do and no step has explained these: a
step that promises less brings the model no nearer to that. Of a complete one steps far from the root promise 5 %."""
LEFT = 0.3, 5.0
"""Fall of the cost that a step has to promise by the normal equations to be tried, and after one that failed."""
PATIENCE, WORTH = 6, 30.0
"""Steps along new paths in a row that do not lower the cost, after which it is no use to go on, and fall of the cost
that paths of other slips give: what gains less is the last."""
ACCIDENT = 20.0
"""Cost of a stretch beyond which a slip is missed: an accident of its path, which says nothing of the parameters."""


@dataclass(frozen=True)
class BestPathsNoiseAware(MendedNoiseAware):
    """The fit of one kernel of a force with error to some grids, along the best of several paths (`PathEstimator`)."""

    def resolving(self, theta: Array) -> BestPathsNoiseAware:
        """The same with sub-steps that resolve a slip of theta (m,), where damped steps do not follow the bristle."""
        if not self.kernel.damped:
            return self
        return self.with_freedom(freedom_for(self.coordinates.values(theta), self.grids))

    def explains(self, end: Estimate) -> bool:
        """Whether the innovations of an end look like noise."""
        by_nodes = resolved_by_nodes(self.coordinates.values(end.theta), spacing_of(self.grids))
        return converged(end, resolved=by_nodes and not self.kernel.damped)

    @property
    def coarse(self) -> BestPathsNoiseAware:
        """The same in longer sub-steps, for fits to chunks."""
        return self.with_freedom(replace(self.freedom, h_max=COARSER * self.freedom.h_max))

    def start(self, theta: Array, steps: int = NEW_PATH) -> Estimate | None:
        """The estimate at fixed parameters theta (m,), along new paths that take so many steps. None where the model
        diverges.
        """
        new = self.along_new(theta, steps)
        return None if new is None else self.mended(new)

    def along_new(self, theta: Array, steps: int = NEW_PATH) -> Estimate | None:
        """The estimate at theta along new paths, whatever slips they miss."""
        firsts = self._best_new(theta)
        best = None if firsts is None else self._loosened(theta, firsts)
        return None if best is None else self.along(theta, best, steps)

    def fit(self, theta: Array, steps: int, _vain: Callable[[Estimate], bool] | None = None) -> Estimate | None:
        """The estimate where steps along new paths lead from theta (m,): slips that they miss make costs on the way
        differ by thousands, which says little of the end. None where the model diverges.
        """
        first = self.along_new(theta)
        if first is None:
            return None
        [last] = deque(self._way(first, steps), maxlen=1)
        return self.mended(last)

    def first(self, theta: Array, _steps: int) -> Estimate | None:
        """The estimate at theta (m,) along new paths, where starts differ at once. None where the model diverges."""
        new = self.along_new(theta)
        return None if new is None else lean(new)

    def further(self, first: Estimate, steps: int, vain: Callable[[Estimate], bool]) -> Estimate:
        """The best estimate on the way that steps along new paths take, not the last: far from the end, or without one,
        slips that paths miss make costs differ by thousands from step to step. vain : whether it is, to go on after a
        third of the steps.
        """
        best = first
        for done, now in enumerate(self._way(self.along(first.theta, first.paths, 0) or first, steps)):
            best = min(best, lean(now), key=lambda one: one.cost)
            if 3 * done >= steps and vain(best):
                break
        return self.mended(best)

    def followed(self, now: Estimate, steps: int = FOLLOWED) -> tuple[Estimate, bool]:
        """The estimate to which steps along new paths lead, whatever it costs, and whether it is a root: near one only
        chance makes one step better than another. Where others on the way cost much less it is none, and the end of a
        descent from the best of them is taken. Nor is it one where a step promises little of much that is left.
        """
        best, end = self._best_on_the_way(now, steps)
        if end.settled and end.cost < best.cost + WORTH:
            return end, self._promises_less(end, max(ENOUGH, self.worth))
        return self.descend(best, LAST), False

    def _best_on_the_way(self, now: Estimate, steps: int) -> tuple[Estimate, Estimate]:
        """Of the steps from an estimate along new paths that slip as the data do the best one, and the last: there are
        no more where `PATIENCE` in a row are no better.
        """
        best, end, vain = now, now, 0
        for end in itertools.islice(self._way(now, steps, self.mended, NOTABLE), 1, None):
            best, vain = (end, 0) if self._is_better(end, best) else (best, vain + 1)
            if vain == PATIENCE:
                break
        return best, end

    def _is_better(self, one: Estimate, other: Estimate) -> bool:
        """Whether an estimate costs less than another, and explains as much: a model that lacks much also costs less
        the more it is sure of itself, and so its mass may grow without end while it explains less and less.
        """
        return one.cost < other.cost and (one.loss < other.loss or self.explains(one))

    def step(self, now: Estimate) -> Array:
        """The move (m,) of one step of Gauss and Newton from an estimate; 0 where there is none."""
        solved = self._solved(now)
        return np.zeros_like(now.theta) if solved is None else solved.move

    def _solved(self, now: Estimate) -> Step | None:
        return gauss_newton(now.normal, now.theta, LONGEST, self.coordinates.bounds)

    def _way(
        self, now: Estimate, steps: int, mended: Callable[[Estimate], Estimate] = lambda new: new, notable: float = 0.0
    ) -> Iterator[Estimate]:  # fmt: skip
        """An estimate, and those after Gauss-Newton's steps along paths that are new at every one of them, whether the
        cost falls or not.

        What a model explains about a path is what it would explain at the end of the next step of the path. It is less
        in the stretches where a path was chosen for that, at the parameters for which it was, and then no step of the
        parameters seems to gain: a descent stops where chance has led its paths.
        The gradient along paths that were not chosen has no such memory. Its root is near the truth, and each step has
        but the chance of its own paths. notable : share of what is left that a step has to promise (`NOTABLE`).
        """
        known, explained = list[float](), False
        yield now
        now = replace(now, settled=False)
        for _ in range(steps):
            solved, explained = self._solved(now), explained or self.explains(now)
            if solved is None or time_is_over():
                return
            lacks = not explained and now.outliers < self.many  # where many slips are missed promises say little
            enough = max(ENOUGH, self.worth, notable * now.unexplained if lacks else 0.0)
            if known and solved.free and solved.decrease < enough:  # a start has a memory of its own
                yield replace(now, settled=True)
                return
            further = self._along_new_or_moved(now, solved.move)
            if further is None:
                return
            now = mended(further)
            known.append(now.cost)
            yield now
            turn = len(known) > FEW and len(known) % FEW == 0
            if turn and np.mean(known[-FEW:]) > np.mean(known[-2 * FEW : -FEW]):
                return

    def _promises_less(self, now: Estimate, enough: float) -> bool:
        """Whether a further step promises a smaller fall of the cost."""
        solved = self._solved(now)
        return solved is not None and solved.decrease < enough

    def _along_new_or_moved(self, now: Estimate, step: Array) -> Estimate | None:
        """The estimate a step further along new paths, and where these miss a slip along those that move along."""
        new = self.along_new(now.theta + step)
        if new is None:
            return None
        p, moved = self.coordinates.p(new.theta), self.moved(now, step)
        own = [stretch_costs(*pair) for pair in zip(self.grids, new.linearised, strict=True)]

        def missed(i: int) -> NDArray[np.bool_]:
            line = self.held.line(i, p, moved[i])
            late = own[i] > (np.inf if line is None else stretch_costs(self.grids[i], line) + ACCIDENT)
            return np.asarray(late[stretches(self.grids[i])])

        nodes = each(missed, range(len(self.grids)))
        if not any(some.any() for some in nodes):
            return new
        new = lean(new)  # its matrices take as much again as those of the estimate that follows
        paths = [np.where(some[:, None], *pair) for some, *pair in zip(nodes, moved, new.paths, strict=True)]
        mixed = self.along(new.theta, paths, 1)
        return mixed if mixed is not None and mixed.cost < new.cost else self.along(new.theta, new.paths, 0)

    def _best_new(self, theta: Array, known: Sequence[Sequence[Array]] = ()) -> list[Array] | None:
        """The best of new paths, and of known ones, that have not come to rest."""
        p, h_max = self.coordinates.p(theta), self.freedom.h_max
        return self._best_paths(
            theta, lambda i: [*first_paths(self.kernel, self.grids[i], p, h_max), *(paths[i] for paths in known)]
        )

    def _loosened(self, theta: Array, firsts: list[Array]) -> list[Array] | None:
        """New paths that first come to rest under a force that is known less well than it is, where that explains more:
        one that slips late stays there otherwise.
        """
        work, p = self.with_freedom(replace(self.freedom, force=LOOSE)).held, self.coordinates.p(theta)

        def loose(i: int) -> Array | None:
            line = work.line(i, p, firsts[i])
            return None if line is None else work._stepped(i, p, firsts[i], line, LOOSE_STEPS)

        return self._best_paths(theta, lambda i: [loose(i), firsts[i]])

    def _moved_to(self, theta: Array, known: Sequence[Sequence[Array]]) -> Estimate | None:
        """The estimate at theta along the best of new and known paths, whatever slips they miss."""
        best = self._best_new(theta, known)
        return None if best is None else self.along(theta, best, NEW_PATH)

    def refit(
        self, theta: Array, paths: Sequence[Array], steps: int, vain: Callable[[Estimate], bool] | None = None
    ) -> Estimate | None:
        """The estimate after a descent along new paths, or those that another model left. None where it diverges.

        Steps are taken that gain but for slips which their paths miss. So what ends above its start is mended; where it
        stays there, the start is the better one.
        """
        start = handed_over(self._along_new_or_known(theta, paths))
        if not start:
            return None
        start.append(self.mended(start.pop()))
        first = lean(start[0])
        end = self.descend(start.pop(), steps, vain)
        return min(first, self.mended(end) if end.cost > first.cost else end, key=lambda one: one.cost)

    def _along_new_or_known(self, theta: Array, known: Sequence[Array]) -> Estimate | None:
        """The estimate at theta along the best of new paths and of known ones, stretch by stretch or as a whole. They
        are compared once they have come to rest: known ones, of other parameters, are nearer to the measurements at
        first, and may stay where they slip late.
        """
        rested = [*_without_matrices(self.along_new(theta)), *_without_matrices(self.along(theta, known, NEW_PATH))]
        best = self._best_paths(theta, lambda i: [one.paths[i] for one in rested]) if rested else None
        mixed = None if best is None else self.along(theta, best, 1)
        least = min(rested, key=lambda one: one.cost, default=None)
        if least is None or (mixed is not None and mixed.cost < least.cost):
            return mixed
        mixed = None  # its matrices take as much again as those of what follows
        return self.along(theta, least.paths, 0)

    def descended(self, now: Estimate, most: float = HOPELESS) -> Estimate:
        """The end of a descent from an estimate; most : loss that its first steps may leave."""
        for steps in (STEPS, LAST):
            if now.loss > HOPELESS:
                break
            now = self.descend(now, steps)
            if now.settled or now.loss > most or converged(now, resolved=False):
                break
        return lean(now)

    def rested(self, now: Estimate, steps: int) -> Estimate | None:
        """An estimate after so many further steps of its paths, where they lower the cost: they may lose a slip."""
        end = super().rested(now, steps)
        return now if end is None or end.cost > now.cost else end

    def relaxed(
        self, i: int, p: Array, path: Array, line: Innovations, steps: int
    ) -> tuple[Array, Innovations] | None:  # fmt: skip
        """A path of grid i, with the innovations about it, after so many steps to the smoothed one; None where the
        model diverges.
        """
        if not steps:
            return path, line
        best = self._stepped(i, p, path, line, steps)
        end = None if best is None else self.line(i, p, best)
        return None if best is None or end is None else (best, end)

    def _stepped(self, i: int, p: Array, path: Array, line: Innovations, steps: int) -> Array | None:
        """A path of grid i after so many steps to the smoothed one; None where the model diverges. A stretch in which a
        step does harm goes back most of the way: about a break-away that is a sample late the next path can be further
        off, while all others come to rest.
        """
        stretch = stretches(self.grids[i])
        best, least, better = path, stretch_costs(self.grids[i], line), np.ones(stretch[-1] + 1, bool)
        for _ in range(steps):
            step = self.predictor.toward(line, share=self.freedom.share)
            path = np.where(better[stretch][:, None], path + step, best + BACK * (path - best))
            further = self.held.line(i, p, path)
            if further is None:
                return None
            line = further
            misfit = stretch_costs(self.grids[i], line)
            better = misfit < least + WORSE
            best, least = np.where(better[stretch][:, None], path, best), np.where(better, misfit, least)
        return np.ascontiguousarray(best)

    def gained(self, now: Estimate, trial: Estimate) -> float:
        """By how much a trial explains more than an estimate, in units of the cost: in all, or with no stretch counting
        for more than `ACCIDENT`.
        """
        fall = 0.0
        for grid, old, new in zip(self.grids, now.linearised, trial.linearised, strict=True):
            fall += float(np.clip(stretch_costs(grid, old) - stretch_costs(grid, new), -ACCIDENT, ACCIDENT).sum())
        return max(fall, now.cost - trial.cost)

    def trial(self, now: Estimate, step: Array) -> Estimate | None:
        """The estimate a step further, along new paths, the present ones, or those moved along, whichever explain more.

        The present and the moved ones alone would cost thousands more, and good steps be lost. Slips that are missed
        only matter where the step does not gain without them.
        """
        trial = self._moved_to(now.theta + step, [now.paths, self.moved(now, step)])
        return trial if trial is None or self.gained(now, trial) > 0 else self.mended(trial, now)

    @property
    def left(self) -> tuple[float, float]:
        """Falls of the cost by the normal equations below which no step is tried, at once and after one that failed:
        other paths cost more by chance.
        """
        return LEFT

    def _best_paths(
        self, theta: Array, candidates: Callable[[int], Sequence[Array | None]]
    ) -> list[Array] | None:  # fmt: skip
        """For every grid the best of its candidates; None where one has none with a solution."""
        p = self.coordinates.p(theta)
        found = each(lambda i: self._best_of(i, p, candidates(i)), range(len(self.grids)))
        known = [path for path in found if path is not None]
        return known if len(known) == len(found) else None

    def _best_of(self, i: int, p: Array, paths: Sequence[Array | None]) -> Array | None:
        """Of some paths of grid i (n, n_states), in every stretch the one about which the model explains the
        measurements best. None where it has no solution.
        """
        stretch, known, misfits = stretches(self.grids[i]), list[Array](), list[Array]()
        for path in paths:
            line = None if path is None else self.held.line(i, p, path)
            if path is not None and line is not None:
                known.append(path)
                misfits.append(stretch_costs(self.grids[i], line))  # the line itself takes a kilobyte a node
        return stretchwise(stretch, known, misfits) if known else None


def _without_matrices(estimate: Estimate | None) -> list[Estimate]:
    """An estimate without its matrices, in a list; none without one."""
    return [] if estimate is None else [lean(estimate)]


def noise_aware_for(
    valve: Kernel, coordinates: Coordinates, segment_grids: Sequence[Grid], starts: Sequence[Array], order: Order
) -> BestPathsNoiseAware:
    """The estimator in full or damped order for the grids of some experiments, from starting values (m,), of which the
    likeliest is first. Nodes or sub-steps are as close as they ask for.
    """
    damped = order == "damped"
    with_error = kernel(valve.effects, "force with error", valve.catalogue, damped=damped)
    nodes = segment_grids if damped else resolving(segment_grids, quickest(coordinates, starts))
    smooth = each(lambda grid: grid.with_local_smoothing(), nodes)  # longest where least happens
    return BestPathsNoiseAware(with_error, coordinates, smooth, FREEDOM).resolving(starts[0])


def freedom_for(values: Mapping[str, float], segment_grids: Sequence[Grid]) -> PathFreedom:
    """The freedom of paths whose sub-steps resolve a slip in some grids, for parameters by full name."""
    return replace(FREEDOM, h_max=sub_step(values, spacing_of(segment_grids)) / FINER)


def spacing_of(segment_grids: Sequence[Grid]) -> float:
    """The time between two measured positions [s], of the grid where it is longest."""
    return max(float(np.median(np.diff(grid.t[np.isfinite(grid.y)]))) for grid in segment_grids)
