"""Runs of the model through the slips that a path misses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stiff_valves import STIFF, stem_test

from identification import experiment
from identification.data.grid import grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import costs
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.shots import OFFSETS, best_offset, missed_slips, shots, window
from simulator import BASE, kernel


@pytest.fixture(scope="module")
def late():
    """The fit of a stem test of 12 s at the true values, its path at rest, and one whose slips are two nodes late."""
    known = grids([experiment(r) for r in stem_test(100.0, ("sine:12",))])
    coordinates = Coordinates.of(kernel(BASE), {}, 700.0)
    theta = coordinates.theta_of(STIFF)
    whole = noise_aware_for(kernel(BASE), coordinates, known, [theta], "damped")
    right = whole.start(theta)
    assert right is not None
    path = right.paths[0].copy()
    path[2:, :-2] = right.paths[0][:-2, :-2]
    wrong = whole.along(theta, [path], 0)
    assert wrong is not None
    return whole, right, wrong


def test_a_right_path_misses_hardly_a_slip_and_a_late_one_most(late):
    whole, right, wrong = late
    missed = missed_slips(whole.grids[0], wrong.linearised[0])
    assert len(missed) > 10
    assert len(missed_slips(whole.grids[0], right.linearised[0])) <= 2
    for first, last in missed:
        begin, end = window(whole.grids[0], (first, last))
        assert 0 <= begin <= first <= last < end <= len(whole.grids[0].t)


def test_some_run_slips_as_the_data_do_wherever_a_path_is_late(late):
    whole, right, wrong = late
    [grid], p, found = whole.grids, whole.coordinates.p(right.theta), 0
    missed = missed_slips(grid, wrong.linearised[0])
    for slip in missed:
        begin, end = window(grid, slip)
        part = grid.part(begin, end)
        alone = replace(whole, grids=[part])

        def misfit(path, alone=alone):
            line = alone.line(0, p, path)
            return np.inf if line is None else float(costs(*line.scored).sum())

        # the run begins on a path that is right up to there, as it is where one slip alone is missed
        path = np.ascontiguousarray(wrong.paths[0][begin:end])
        path[: slip[0] - begin] = right.paths[0][begin : slip[0]]
        runs = shots(whole.kernel, part, p, whole.freedom.h_max, path, slip[0] - begin, misfit)
        found += min(map(misfit, runs)) < misfit(path)
    assert found > 0.9 * len(missed)


def test_the_best_offset_is_refined_between_its_neighbours():
    assert best_offset(lambda off: (off - 0.3) ** 2) == pytest.approx(0.3, abs=0.01)
    assert best_offset(lambda off: np.inf if off < 0.9 else off) == pytest.approx(1.0, abs=0.1)
    assert best_offset(lambda off: abs(off - 9.0)) == pytest.approx(OFFSETS[-1], abs=0.02)
