"""Paths that slip where the data do: about every slip that a path misses, the best of some others.

A path that slips a sample early or late costs hundreds, and no step of a smoother leads from there to the right one.
So about such a slip other paths are tried: along the smoothed motion, without overshoot, and runs of the model under
the offset of the force with which they slip as the data do (`shots.py`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.budget import time_is_over
from identification.estimators.estimate import Estimate, Innovations, costs
from identification.estimators.noise_aware.estimator import EQUAL, NEW_PATH, NoiseAware
from identification.estimators.noise_aware.paths import along_smooth_motion, without_overshoot
from identification.estimators.noise_aware.shots import missed_slips, shots, window
from identification.estimators.noise_aware.stretches import stretch_costs, stretches, stretchwise
from identification.parallel import each
from recordings import Array

OTHERS, SHOT_RESTING = (along_smooth_motion, without_overshoot), 4
"""What is tried about a slip that is missed, beside runs of the model, and steps in which it comes to rest."""
ROUNDS, RESTING, PATIENCE = 3, 2, 6
"""Times at most that slips are looked for, steps in which the path with those that were found comes to rest, and slips
in a row that no path explains after which no more are looked for."""
MANY = 4e-2
"""Share of innovations far off from which it is more than some slips that a path misses: far from the right model,
looking for them costs most and gains least."""


@dataclass(frozen=True)
class MendedNoiseAware(NoiseAware):
    """The fit of one kernel of a force with error to some grids, whose new paths slip where the data do (a
    `PathEstimator`).

    many : share of innovations far off from which slips that the paths miss are not looked for.
    """

    many: float = MANY

    def start(self, theta: Array, steps: int = NEW_PATH) -> Estimate | None:
        """The estimate at fixed parameters theta (m,), along new paths that take so many steps. None where the model
        diverges.
        """
        new = super().start(theta, steps)
        return None if new is None else self.mended(new)

    def mended(self, now: Estimate, before: Estimate | None = None) -> Estimate:
        """An estimate whose paths slip where the data do: about a slip that is missed, the best of some paths. Those
        that were missed before are not looked for again.
        """
        vain: list[set[int]] = [set() for _ in self.grids]
        known = [set[int]() for _ in self.grids] if before is None else self._missed(before)
        for _ in range(ROUNDS if now.outliers < self.many else 0):
            end = None if time_is_over() else self._through_slips(now, vain, known)
            if end is None or end.cost > now.cost - EQUAL:
                break
            now = replace(end, settled=now.settled)
        return now

    def _missed(self, now: Estimate) -> list[set[int]]:
        """The first nodes of the slips that an estimate misses, by grid."""
        pairs = zip(self.grids, now.linearised, strict=True)
        return [{first for first, _ in missed_slips(grid, line)} for grid, line in pairs]

    def _through_slips(
        self, now: Estimate, vain: Sequence[set[int]], known: Sequence[set[int]]
    ) -> Estimate | None:  # fmt: skip
        """An estimate along paths with the best that can be found about every slip that is missed, but those that were
        looked for in vain, and those known before, by grid. None where nothing better is.
        """
        p = self.coordinates.p(now.theta)
        ends = each(lambda i: self._end_through_slips(i, p, now, vain[i], known[i]), range(len(self.grids)))
        if all(end is None for end in ends):
            return None
        olds = zip(now.paths, now.linearised, strict=True)
        paths, lines = zip(*(old if end is None else end for end, old in zip(ends, olds, strict=True)), strict=True)
        return self._estimate(now.theta, paths, lines)

    def _end_through_slips(
        self, i: int, p: Array, now: Estimate, vain: set[int], known: set[int]
    ) -> tuple[Array, Innovations] | None:  # fmt: skip
        """Where the path of grid i comes to rest from the best about every slip; None where nothing better is found."""
        path, work = self._better_path(i, p, now.paths[i], now.linearised[i], vain, known), self.held
        line = None if path is None else work.line(i, p, path)
        end = None if path is None or line is None else work.relaxed(i, p, path, line, RESTING)
        if end is None:
            return None
        stretch = stretches(self.grids[i])
        misfits = [stretch_costs(self.grids[i], one) for one in (now.linearised[i], end[1])]
        best = stretchwise(stretch, [now.paths[i], end[0]], misfits)
        line = work.line(i, p, best)
        return None if line is None else self.relaxed(i, p, best, line, NEW_PATH)

    def _better_path(
        self, i: int, p: Array, path: Array, line: Innovations, vain: set[int], known: set[int]
    ) -> Array | None:  # fmt: skip
        """A path of grid i (n, n_states) with the best that can be found about every slip that it misses, until
        `PATIENCE` in a row are found by none: what the model lacks no path has. None where nothing better is.

        vain : first nodes of slips that were looked for in vain, which this adds to; known : of those that are not
        looked for.
        """
        found, better, failures = path.copy(), False, 0
        slips = [slip for slip in missed_slips(self.grids[i], line) if slip[0] not in known]
        for slip in slips:
            if failures == PATIENCE:
                break
            if slip[0] in vain:
                failures += 1
                continue
            begin, end = window(self.grids[i], slip)
            part = replace(self.held, grids=[self.grids[i].part(begin, end)])
            best, explained = part._best_about(p, np.ascontiguousarray(found[begin:end]), slip[0] - begin)
            if best is None:
                vain.add(slip[0])
            else:
                found[begin:end], better = best, True
            failures = 0 if explained else failures + 1
        return found if better else None

    def _best_about(self, p: Array, path: Array, first: int) -> tuple[Array | None, bool]:
        """Of some paths of the only grid, at rest, the first that misses no slip, or the one about which the model
        explains most, None where that is the given one (n, n_states), and whether it misses none; first : node that
        the given path misses.
        """
        [grid], still, h_max = self.grids, None, self.freedom.h_max

        def misfit(candidate: Array) -> float:
            return _cost(self.line(0, p, candidate))

        others = (other(self.kernel, grid, p, path) for other in OTHERS)
        least = misfit(path)
        for candidate in itertools.chain(others, shots(self.kernel, grid, p, h_max, path, first, misfit)):
            line = None if candidate is None else self.line(0, p, candidate)
            end = None if candidate is None or line is None else self.relaxed(0, p, candidate, line, SHOT_RESTING)
            value = np.inf if end is None else _cost(end[1])
            if end is None or value > least - EQUAL:
                continue
            still, least = end[0], value
            if not missed_slips(grid, end[1]):
                return still, True
        return still, False


def _cost(line: Innovations | None) -> float:
    """The cost of all innovations, infinite where the model has no solution."""
    return np.inf if line is None else float(costs(*line.scored).sum())
