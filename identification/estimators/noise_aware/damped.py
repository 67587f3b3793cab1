"""The noise-aware estimate where the sampling shows a slip and not the bristle: parameters and paths in damped steps.

A slip lasts a few samples here. About the smoothed motion, which blurs it, the model does not find home; so paths
start, stretch by stretch, from whichever explains the measurements better, the smoothed motion or runs of the model
that are set back to the data. A step of a path that does harm in a stretch is taken back there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.budget import time_is_over
from identification.data.grid import Grid
from identification.estimators.anchors import deflection_at_rest
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import HOPELESS, Estimate, Innovations, costs, lean
from identification.estimators.noise_aware.estimator import EQUAL, NEW_PATH, NoiseAware, Stages
from identification.estimators.noise_aware.linearised_model import PathFreedom, first_path
from identification.estimators.noise_aware.search import HOPELESS_TRIES, NOT_FAR, RIGHT, UNEXPLAINED, chunks
from identification.estimators.noise_aware.set_back import set_back_path
from identification.estimators.order import sub_step
from identification.parallel import each
from recordings import Array, IndexArray, Progress, silent
from simulator import Kernel, kernel

FREEDOM = PathFreedom(1.0, 1e-4, 0.1)
"""Freedom of the path; it makes up for what the steps damp."""
FINER = 4
"""Part of the longest sub-step that resolves a slip which the fit takes: the step's own error biases mass and viscous
friction by more than the noise does (at full size by ten standard deviations, at a quarter by none that shows)."""
COARSER = 2
"""Times that a sub-step is longer on chunks: what that makes wrong, the descent on whole recordings mends."""
WIDEST = 0.01
"""Time between the nodes of a path [s] at most."""
STRETCH = 0.5
"""Length [s] of the stretches in which paths are chosen: a slip, and the rest behind it."""
WORSE, BACK = 0.1, 0.3
"""Rise of the cost of a stretch from which a step of its path does harm, and the share of the step that is kept."""
STEPS, ROUNDS, LAST, DESCENTS = 6, 6, 12, 2
"""Steps of a descent on chunks before it goes on along new paths, times that it does at most, steps on whole
recordings and descents there at most."""
SLOW = 0.5
"""Share of the Stribeck velocity below which the stem creeps."""
LOOSE, LOOSE_STEPS = (10.0, 3.0), 3
"""Factors on the noise of the force while a new path comes to rest at first, one after the other, and steps of each."""
RESTING = 2
"""Steps of the path alone before a step of the parameters is judged, where it has not helped at once."""
LEFT = 0.3
"""Fall of the cost that a step has to promise by the normal equations to be tried."""
CHANCE = 10.0
"""Fall of the cost that other paths give by chance: a step that promises less is not tried along them."""
NOTABLE = 30.0
"""Fall of the cost from which going on along new paths is worth its time."""
VAIN_TRIES = 2
"""Starts in a row that lead to nothing better after which the best end is taken."""
CHUNK, CHUNK_S = 1000, 4.0
"""Least nodes and seconds of a chunk."""


@dataclass(frozen=True)
class DampedNoiseAware(NoiseAware):
    """The fit of one kernel of a force with error, in damped steps, to some grids (a `PathEstimator`).

    thorough : paths rest twice as long before a step of the parameters is judged, and it is tried along others,
    whatever it promises.
    """

    thorough: bool = False

    def start(self, theta: Array, steps: int = NEW_PATH) -> Estimate | None:
        """The estimate at fixed parameters theta (m,), along new paths that take so many steps. None where the model
        diverges.

        A path that slips a sample early or late stays there, as no small step leads to the right slip. So paths first
        come to rest under forces that are known less well than they are, and are kept where that explains more.
        """
        p = self.coordinates.p(theta)
        firsts = self._best_paths(theta, lambda i: [balanced_path(self.kernel, self.grids[i], p), self._set_back(i, p)])
        if firsts is None:
            return None
        loose: Sequence[Array] = firsts
        for force in LOOSE:
            end = self.with_freedom(replace(self.freedom, force=force)).along(theta, loose, LOOSE_STEPS)
            loose = loose if end is None else end.paths
        best = self._best_paths(theta, lambda i: [loose[i], firsts[i]])
        return None if best is None else self.along(theta, best, steps)

    def refit(
        self, theta: Array, paths: Sequence[Array], steps: int, vain: Callable[[Estimate], bool] | None = None
    ) -> Estimate | None:
        """The estimate after descents: first along paths that another model left, then each along new paths, as long as
        that helps. None where the model diverges.
        """
        best = super().refit(theta, paths, steps, vain)
        return self.on_new_paths(theta if best is None else best.theta, best, vain)

    def on_new_paths(
        self, theta: Array, best: Estimate | None = None, vain: Callable[[Estimate], bool] | None = None,
        most: float = HOPELESS,
    ) -> Estimate | None:  # fmt: skip
        """The end of descents from theta (m,), each along new paths, as long as that helps. None where the model
        diverges. best : the estimate so far, where there is one; vain : whether it is, to go on; most : loss that two
        descents may leave.

        The smoother holds on to slips that a path has, and to rests; the model at better parameters has others.
        """
        for done in range(ROUNDS):
            if best is not None and (time_is_over() or (vain is not None and vain(best))):
                break
            start = self.start(theta)
            if start is None:
                break
            end = self.descend(start, STEPS, vain)
            fall = float("inf") if best is None else best.cost - end.cost
            best = lean(end) if fall > 0 or best is None else best
            lost = end.loss > (most if done else HOPELESS)
            if fall < NOTABLE or lost or np.array_equal(end.theta, theta):
                break
            theta = end.theta
        return best

    def relaxed(
        self, i: int, p: Array, path: Array, line: Innovations, steps: int
    ) -> tuple[Array, Innovations] | None:  # fmt: skip
        """A path of grid i, with the innovations about it, after so many steps to the smoothed one; None where the
        model diverges. A stretch in which a step does harm goes back most of the way: about a break-away that is a
        sample late the next path can be further off, while all others come to rest.
        """
        stretch, still = _stretches(self.grids[i]), np.zeros(self.coordinates.n_free)
        best, least, better = path, _misfit(stretch, line), np.ones(stretch[-1] + 1, bool)
        for _ in range(steps):
            step = self.freedom.share * self.predictor.toward(line, still)
            path = np.where(better[stretch][:, None], path + step, best + BACK * (path - best))
            further = self.line(i, p, path)
            if further is None:
                return None
            line = further
            misfit = _misfit(stretch, line)
            better = misfit < least + WORSE
            best, least = np.where(better[stretch][:, None], path, best), np.where(better, misfit, least)
        if better.all():
            return path, line
        path = np.ascontiguousarray(best)
        back = self.line(i, p, path)
        return None if back is None else (path, back)

    def trial(self, now: Estimate, step: Array) -> Estimate | None:
        """The estimate a step further. Where that is not better at once, its paths come to rest first; where that does
        not help, paths at rest from the best of the moved path, the present one and one that is set back to the data
        may. Other paths cost hundreds more or less by chance, so they come last: judged by them, good steps are lost.
        """
        theta, moved = now.theta + step, self.moved(now, step)
        first = best = self.along(theta, moved, 0)
        resting = 2 * RESTING if self.thorough else RESTING

        def at_rest() -> Estimate | None:
            return None if first is None else self.rested(first, resting)

        def on_best() -> Estimate | None:
            p = self.coordinates.p(theta)
            best = self._best_paths(theta, lambda i: [moved[i], now.paths[i], self._set_back(i, p)])
            return None if best is None else self.along(theta, best, resting)

        promised = -float(2 * now.normal.gradient @ step + step @ now.normal.matrix @ step)
        ways = (at_rest, on_best) if self.thorough or promised > CHANCE else (at_rest,)
        for way in ways if self.dense else ():
            if best is not None and best.cost < now.cost + EQUAL:
                break
            ends = [end for end in (best, way()) if end is not None]
            best = min(ends, key=lambda end: end.cost, default=None)
        return best

    @property
    def left(self) -> float:
        """Fall of the cost by the normal equations below which no step is tried: other paths cost more by chance."""
        return LEFT

    @property
    def last_stages(self) -> Stages:
        """The stage of a fit to whole recordings: there is but one."""
        return ((self.freedom, LAST),)

    @property
    def strict_freedom(self) -> PathFreedom:
        """The freedom of the paths by which ends of fits are judged."""
        return self.freedom

    def _set_back(self, i: int, p: Array) -> Array | None:
        return set_back_path(self.kernel, self.grids[i], p, self.freedom.h_max)

    def _best_paths(
        self, theta: Array, candidates: Callable[[int], Sequence[Array | None]]
    ) -> list[Array] | None:  # fmt: skip
        """For every grid the best of its candidates; None where one has none with a solution."""
        p = self.coordinates.p(theta)
        best = each(lambda i: self._best_of(i, p, candidates(i)), range(len(self.grids)))
        known = [path for path in best if path is not None]
        return known if len(known) == len(best) else None

    def _best_of(self, i: int, p: Array, paths: Sequence[Array | None]) -> Array | None:
        """Of some paths of grid i (n, n_states), in every stretch the one about which the model explains the
        measurements best. None where it has no solution.
        """
        known, misfits, stretch = list[Array](), list[Array](), _stretches(self.grids[i])
        for path in paths:
            line = None if path is None else self.line(i, p, path)
            if path is not None and line is not None:
                known.append(path)
                misfits.append(_misfit(stretch, line))
        if not known:
            return None
        return np.ascontiguousarray(np.array(known)[np.argmin(misfits, axis=0)[stretch], np.arange(len(stretch))])


def balanced_path(kernel: Kernel, grid: Grid, p: Array) -> Array | None:
    """A first path (n, n_states) on which the bristle balances the forces wherever the stem creeps or rests. None
    without a solution.

    A valve whose controller integrates creeps for seconds just below break-away. No run of the model stays there: an
    error of the force that nobody can measure makes it slip, and its bristle slides off. The balance knows better.
    """
    path = first_path(kernel, grid, p)
    if path is None:
        return None
    values = dict(zip(kernel.parameters, p.tolist(), strict=True))
    x, v, _ = grid.motion.T
    slow = np.abs(v) < SLOW * values["lugre.vs"]
    held = deflection_at_rest(values, grid.force.u - values["lugre.sigma2"] * v, x)
    z = kernel.states.index("lugre.z")
    path[:, 1], path[:, z] = v, np.where(slow, held, path[:, z])
    return path


def _stretches(grid: Grid) -> IndexArray:
    """The number of the stretch that each node of a grid lies in, (n,)."""
    return np.asarray((grid.t - grid.t[0]) // STRETCH, int)


def _misfit(stretch: IndexArray, line: Innovations) -> Array:
    """The cost of the innovations in each stretch, by which estimates are compared, (n_stretches,)."""
    return np.asarray(np.bincount(stretch, costs(*line.scored)), float)


def damped_for(
    valve: Kernel, coordinates: Coordinates, segment_grids: Sequence[Grid], theta: Array
) -> DampedNoiseAware:
    """The estimator for the grids of some experiments, with nodes and sub-steps that resolve a slip of theta (m,)."""
    with_error = kernel(valve.effects, "force with error", valve.catalogue, damped=True)
    smooth = each(lambda grid: grid.with_local_smoothing(), segment_grids)  # longest where least happens
    return DampedNoiseAware(with_error, coordinates, close(smooth), freedom_for(coordinates.values(theta)))


def freedom_for(values: Mapping[str, float]) -> PathFreedom:
    """The freedom of paths whose sub-steps resolve a slip, for parameters by full name."""
    return replace(FREEDOM, h_max=sub_step(values) / FINER)


def close(segment_grids: Sequence[Grid]) -> list[Grid]:
    """Grids with nodes close enough for a slip."""
    return [grid.divided(max(1, round(float(np.median(np.diff(grid.t))) / WIDEST))) for grid in segment_grids]


def best_on_chunks(
    whole: DampedNoiseAware, starts: Sequence[Array], enough: Callable[[Estimate], bool], progress: Progress = silent
) -> Estimate | None:
    """The best end on chunks from starting values (m,), the likeliest first, until it is enough or known to be the
    right one: one may explain the data and not be the best. None where the model diverges from all.
    """
    freedom = replace(whole.freedom, h_max=COARSER * whole.freedom.h_max)
    small, ends = replace(whole, grids=chunks(whole.grids, CHUNK, CHUNK_S), freedom=freedom), list[Estimate]()
    for tries, start in enumerate(starts, 1):
        progress("search on chunks", tries - 1, len(starts))
        least = min((end.loss for end in ends), default=UNEXPLAINED)
        end = small.on_new_paths(start, most=min(UNEXPLAINED, NOT_FAR * least))
        if end is not None and enough(end):  # what damped steps leave is no reason to stop where they are not needed
            end = small.on_new_paths(end.theta, end)
        ends += [] if end is None else [end]
        hopeless = tries >= HOPELESS_TRIES and all(end.loss > UNEXPLAINED for end in ends)
        if ends and (hopeless or _is_known(ends) or enough(_best(ends)) or time_is_over()):
            break
    return _best(ends) if ends else None


def _best(ends: Sequence[Estimate]) -> Estimate:
    return min(ends, key=lambda end: end.cost)


def _is_known(ends: Sequence[Estimate]) -> bool:
    """Whether the best of some ends explains the data and is the right one: several later ones are no better, or
    another is beside it, by its cost or, as paths cost more or less by chance, by its parameters.
    """
    best = _best(ends)
    if best.loss > RIGHT:
        return False
    off = [(end.cost - best.cost, end.theta - best.theta) for end in ends if end is not best and end.loss < RIGHT]
    beside = any(min(cost, float(move @ best.normal.matrix @ move)) < NOTABLE for cost, move in off)
    return beside or any(end is best for end in ends[:-VAIN_TRIES])


def on_whole_recordings(
    whole: DampedNoiseAware, theta: Array, explains: Callable[[Estimate], bool]
) -> tuple[Estimate | None, bool]:
    """The fit to whole recordings from theta (m,), and whether it explains them; where it does not, once more from
    there, thoroughly and along new paths. None where the model diverges.
    """
    found, good = None, False
    for _ in range(DESCENTS):
        end = whole.in_stages(theta)
        end = None if end is None else whole.strict(end)
        if end is not None and (found is None or end.cost < found.cost):
            found, good = end, explains(end)
        if found is None or good or found.loss > HOPELESS or np.array_equal(found.theta, theta) or time_is_over():
            break
        theta, whole = found.theta, replace(whole, thorough=True)
    return found, good
