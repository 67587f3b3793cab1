"""The fit to whole recordings in damped order: steps along new paths, and descents where the model lacks much."""

from __future__ import annotations

import functools
from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.plant_sampling import recordings
from identification.data.grid import grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.noise_aware.best_paths import (
    ENOUGH,
    FOLLOWED,
    NOTABLE,
    PATIENCE,
    BestPathsNoiseAware,
    noise_aware_for,
)
from identification.estimators.noise_aware.search import (
    WholeFit,
    best_on_chunks,
    from_both_sides,
    on_whole_recordings,
)
from simulator import BASE, kernel


@functools.cache
def valve():
    """The estimator of a stem test at 50 Hz, and the true parameters."""
    truth, experiments = recordings(11303, 50.0)
    base = kernel(BASE)
    coordinates = Coordinates.of(base, {}, 700.0)
    theta = coordinates.theta_of(truth)
    return noise_aware_for(base, coordinates, grids(experiments), [theta], "damped"), theta


@pytest.mark.slow
def test_steps_along_new_paths_lead_back_to_the_valve():
    work, theta = valve()
    near = [work.names.index(name) for name in ("spring.K", "lugre.fc", "lugre.fs", "lugre.sigma2")]
    roots = []
    for shift in (0.018, 0.019, 0.02, 0.021, 0.022):  # a path on the way may cost less by chance: the end is no root
        start = work.start(theta + shift * np.sign(np.sin(np.arange(len(theta)))))
        end, is_root = work.followed(start)
        roots.append(is_root)
        assert end.settled
        assert np.abs(end.theta - theta)[near].max() < 0.005
        mended = work.mended(end)
        assert mended.loss < 1.05 < start.loss
        assert mended.settled
    assert any(roots)


@pytest.mark.slow
def test_where_much_is_left_that_no_step_finds_few_are_taken():
    work, theta = valve()
    quiet = replace(work, grids=[replace(grid, noise_y=grid.noise_y / 1.6) for grid in work.grids])
    start = quiet.along_new(theta + 1e-3)
    fewest, few, most = ([*quiet._way(start, FOLLOWED, notable=share)][1:] for share in (10 * NOTABLE, NOTABLE, 0.0))
    end = most[-1]
    assert end.unexplained > 1e3
    assert end.outliers < quiet.many
    assert fewest[-1].settled
    assert len(fewest) < len(most)
    assert not quiet._promises_less(fewest[-1], ENOUGH)
    assert few[-1].settled
    assert len(fewest) <= len(few) <= len(most)
    assert few[-1].unexplained < 1.2 * end.unexplained < start.unexplained


@pytest.mark.slow
def test_what_explains_the_data_goes_on_to_the_root_whatever_share_a_step_promises():
    work, theta = valve()
    start = work.start(theta)
    assert work.explains(start)
    ends = [deque(work._way(start, FOLLOWED, notable=share), maxlen=1).pop() for share in (0.0, 1e9)]
    assert ends[0].cost == ends[1].cost


def test_a_start_that_explains_most_is_tried_first(monkeypatch):
    work, theta = valve()
    worse, better = theta.copy(), theta.copy()
    fs = work.names.index("lugre.fs")
    worse[fs], better[fs] = theta[fs] + 0.6, theta[fs] + 0.06
    losses = []
    monkeypatch.setattr(BestPathsNoiseAware, "descend", lambda self, now, steps: losses.append(now.loss) or now)
    best_on_chunks(work, [worse, better, worse + 1e-4], lambda _: False)
    first = losses[0]
    losses.clear()
    best_on_chunks(work, [better], lambda _: False)
    assert losses[0] == first
    assert first > 2.0


@pytest.mark.parametrize(
    ("ends", "taken", "best"),
    [
        ([(9.0, 1.5), (8.0, 1.4), (8.5, 1.4), (8.6, 1.4), (8.7, 1.4), (1.0, 1.4)], 5, 8.0),  # three in a row no better
        ([(9.0, 1.5), (9.5, 1.5), (9.6, 1.5), (8.0, 1.4), (8.5, 1.4), (8.6, 1.4)], 6, 8.0),  # a better one is the third
        ([(9.0, 5.0), (8.0, 4.0), (7.0, 3.5), (1.0, 0.9)], 3, 7.0),  # they explain nothing
        ([(9.0, 1.5), (1.0, 1.0), (0.0, 1.0)], 2, 1.0),  # it explains the chunks
    ],
)
def test_a_search_ends_where_three_descents_in_a_row_lead_nowhere(monkeypatch, ends, taken, best):
    work, theta = valve()
    start = work.start(theta)
    left = iter([replace(start, cost=1e3 * cost, loss=loss) for cost, loss in ends])
    monkeypatch.setattr(BestPathsNoiseAware, "mended", lambda self, now, *_: now)
    monkeypatch.setattr(BestPathsNoiseAware, "descended", lambda self, now, most: next(left))
    found = best_on_chunks(work, [theta + 0.02 * i for i in range(len(ends))], lambda _: False)
    assert len(ends) - len(list(left)) == taken
    assert found.cost == 1e3 * best


def test_a_step_that_costs_less_and_explains_less_is_none_for_the_better(monkeypatch):
    work, theta = valve()
    now = replace(work.start(theta), loss=1.5)
    losses = [*np.linspace(1.4, 1.2, 9), *np.linspace(1.3, 1.5, 9)]
    steps = [replace(now, cost=now.cost - 100.0 * i, loss=loss) for i, loss in enumerate(losses)]
    monkeypatch.setattr(BestPathsNoiseAware, "_way", lambda *_: iter(steps))
    best, end = work._best_on_the_way(now, FOLLOWED)
    assert (best.cost, best.loss) == (steps[8].cost, steps[8].loss)
    assert end is steps[8 + PATIENCE]
    white = [replace(one, loss=0.9 + 0.001 * i) for i, one in enumerate(steps[:9])]
    monkeypatch.setattr(BestPathsNoiseAware, "_way", lambda *_: iter(white))
    assert work._best_on_the_way(white[0], FOLLOWED)[0] is white[8]


@pytest.mark.slow
def test_a_model_that_lacks_much_is_descended(monkeypatch):
    work, theta = valve()
    end = replace(work.start(theta), loss=10.0)
    calls = []
    monkeypatch.setattr(BestPathsNoiseAware, "followed", lambda self, now, steps=1: (calls.append(now) or now, True))
    found = on_whole_recordings(work, end)
    assert found.explains
    assert not calls


@pytest.mark.slow
def test_a_fit_goes_on_in_sub_steps_that_the_mass_of_its_end_asks_for():
    work, theta = valve()
    coarse = work.with_freedom(replace(work.freedom, h_max=2.0 * work.freedom.h_max))
    found = on_whole_recordings(coarse, coarse.start(theta))
    assert 0.8 < found.work.freedom.h_max / work.freedom.h_max < 1.2
    assert found.explains


@pytest.mark.slow
def test_an_end_that_is_no_root_is_compared_with_those_from_either_side(monkeypatch):
    work, theta = valve()
    mass = work.names.index("mass.m")
    hollow = replace(work.start(theta + np.where(np.arange(len(theta)) == mass, 0.1, 0.0)), settled=True)
    followed, ends = BestPathsNoiseAware.followed, []

    def steps_along_new_paths(self, now, steps=48):
        ends.append(followed(self, now, steps)[0])
        return ends[-1], True

    monkeypatch.setattr(BestPathsNoiseAware, "followed", steps_along_new_paths)
    found = from_both_sides(WholeFit(work, hollow))
    assert found.explains
    assert found.end.cost == min(end.cost for end in ends) < hollow.cost - 30
    assert abs(found.end.theta - theta)[mass] < abs(hollow.theta - theta)[mass] / 2
    far = [np.abs(end.theta - found.end.theta) for end in ends if end.cost < found.end.cost + 60]
    assert np.array_equal(found.to_others, np.max(far, axis=0))


def test_an_end_that_has_not_settled_explains_nothing():
    work, theta = valve()
    start = work.start(theta)
    assert not WholeFit(work, replace(start, settled=False)).explains
    assert WholeFit(work, replace(start, settled=True)).explains


@pytest.mark.slow
def test_a_rest_of_the_paths_never_costs_more():
    work, theta = valve()
    off = 0.02 * np.random.default_rng(3).normal(size=(6, len(theta)))
    starts = [work.start(theta + some) for some in off]
    assert all(work.rested(start, 3).cost <= start.cost for start in starts)
    assert any(work.rested(start, 3).cost < start.cost for start in starts)


def test_none_where_the_model_diverges(monkeypatch):
    work, theta = valve()
    end = work.start(theta)
    monkeypatch.setattr(BestPathsNoiseAware, "start", lambda *_: None)
    assert on_whole_recordings(work, end) is None
