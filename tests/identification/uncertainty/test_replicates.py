"""Replicates of a damped fit: the noise they have, and that they tell a right model from a wrong one."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from numpy.typing import NDArray
from stiff_valves import POSITION_NOISE, STIFF, stem_test

from identification import experiment
from identification.data.grid import with_smooth_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import minimise
from identification.estimators.order import sub_step
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.replicates import STEPS, Replicates, in_windows, replicates
from simulator import BASE, kernel

FREE = ("spring.K", "lugre.fc", "lugre.fs")
FORM = ResidualForm(sub_step(STIFF, 1 / 200) / 4, 0.25, 3.0)
WRONG = {"lugre.fc": 1.1 * STIFF["lugre.fc"], "spring.K": 1.01 * STIFF["spring.K"]}


@functools.cache
def problem() -> Problem:
    """The recordings of a sine and its damped model, with spring and friction free."""
    valve = kernel(BASE, damped=True)
    experiments = with_smooth_force([experiment(r) for r in stem_test(200.0, ("sine:25",))])
    given = {name: value for name, value in STIFF.items() if name not in FREE}
    return Problem(valve, Coordinates.of(valve, given, 1000.0), experiments)


def moved(values: dict[str, float]) -> tuple[NDArray[np.float64], Replicates]:
    """Where the recordings draw the fit from some values, in as many steps, and where its own replicates do."""
    theta = problem().coordinates.theta_of(STIFF | values)
    unknowns = problem().start(theta)
    evaluate = functools.partial(in_windows, problem(), FORM)
    end = minimise(evaluate, unknowns, iterations=STEPS, tolerance=0.0)
    own = replicates(problem(), unknowns, FORM, 3)
    assert end is not None
    assert own is not None
    return end.theta[: len(FREE)] - theta, own


def test_a_right_model_moves_as_little_on_replicates_as_on_the_recordings_and_a_wrong_one_does_not():
    right, own = moved({})
    wrong, others = moved(WRONG)
    assert own.moves.shape == others.moves.shape == (3, len(FREE))
    usual = np.sqrt(np.mean(own.moves**2, axis=0))
    assert np.all(usual < (1e-3, 0.02, 0.01))
    assert np.all(np.abs(right) < (1e-3, 0.02, 0.01))
    for name in ("spring.K", "lugre.fc"):
        i = FREE.index(name)
        assert abs(wrong[i]) > 3 * np.sqrt(np.mean(others.moves[:, i] ** 2))


def test_the_same_seed_draws_the_same_replicates_and_another_one_others():
    unknowns = problem().start(problem().coordinates.theta_of(STIFF))
    one, again, other = (replicates(problem(), unknowns, FORM, 1, seed=seed) for seed in (0, 0, 1))
    assert one is not None
    assert again is not None
    assert other is not None
    assert np.array_equal(one.moves, again.moves)
    assert not np.array_equal(one.moves, other.moves)


def test_the_noise_is_that_of_the_recording():
    [e] = problem().experiments
    assert e.noise_position == pytest.approx(POSITION_NOISE, rel=0.1)
