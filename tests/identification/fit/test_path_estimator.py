"""What holds for every estimator of paths and parameters, whatever it predicts."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from identification import experiment
from identification.estimators import Coordinates, ImposedMotion, NoiseAware, PathEstimator, PathFreedom, grids
from identification.estimators.imposed_motion.grid import imposed_grids
from recordings import Array
from simulator import BASE, CATALOGUE, Excitation, Sensors, kernel, random_valve, simulate

SEED, STEPS = 7, 3
TRUTH, STROKE = random_valve(SEED)
OFF = {"lugre.fc": 1.1, "spring.K": 1.02}
"""Factors on the truth from which a descent starts."""


def estimators() -> dict[str, PathEstimator]:
    sensors = Sensors(250.0, position_noise=2e-4 * STROKE, force_noise=5e-4 * TRUTH["spring.K"] * STROKE)
    recording = simulate(TRUTH, Excitation.parse("sine:6"), sensors, stroke=STROKE, seed=1)[0]
    prepared = [experiment(recording)]
    force = float(np.std(prepared[0].segments[0].u))
    with_error, motion = kernel(BASE, "force with error"), kernel(BASE, "motion")
    imposed = imposed_grids(prepared, motion, motion.vector(TRUTH))
    return {
        "noise-aware": NoiseAware(with_error, Coordinates.of(with_error, {}, force), grids(prepared), PathFreedom()),
        "imposed motion": ImposedMotion(motion, Coordinates.of(motion, {}, force), imposed),
    }


@functools.cache
def work(name: str) -> PathEstimator:
    return estimators()[name]


def start_of(some: PathEstimator) -> Array:
    values = {name: TRUTH[name] * OFF.get(name, 1.0) for name in some.coordinates.names}
    return some.coordinates.theta_of(values)


@pytest.fixture(params=["noise-aware", "imposed motion"])
def estimator(request: pytest.FixtureRequest) -> PathEstimator:
    return work(request.param)


def test_an_estimate_has_a_path_and_innovations_for_every_grid(estimator):
    found = estimator.start(start_of(estimator))
    assert found is not None
    assert len(found.paths) == len(found.linearised) == len(estimator.grids)
    for grid, path, line in zip(estimator.grids, found.paths, found.linearised, strict=True):
        assert len(path) == len(grid.t)
        assert line.innovations.shape == line.variances.shape == (len(grid.t), 2)
        assert line.by.shape == (len(grid.t), 2, len(found.theta))
    assert np.isfinite([found.cost, found.loss, found.outliers]).all()


def test_a_descent_lowers_the_cost_and_leads_towards_the_truth(estimator):
    theta = start_of(estimator)
    first = estimator.start(theta)
    assert first is not None
    end = estimator.descend(first, STEPS)
    assert end.cost < first.cost
    values = estimator.coordinates.values(end.theta)
    assert abs(values["spring.K"] / TRUTH["spring.K"] - 1) < abs(OFF["spring.K"] - 1) / 2
    whole = estimator.fit(theta, STEPS)
    assert whole is not None
    assert whole.cost == end.cost
    assert np.array_equal(whole.theta, end.theta)


def test_its_arguments_stay_as_they_are(estimator):
    theta = start_of(estimator)
    kept = theta.copy()
    first = estimator.start(theta)
    assert first is not None
    paths = [path.copy() for path in first.paths]
    estimator.descend(first, 1)
    assert np.array_equal(theta, kept)
    assert all(np.array_equal(a, b) for a, b in zip(first.paths, paths, strict=True))


def test_where_the_model_diverges_there_is_no_estimate(estimator):
    theta = start_of(estimator)
    theta[:] = np.nan
    assert estimator.start(theta) is None
    assert estimator.fit(theta, STEPS) is None


def test_the_kernel_is_of_the_catalogue_and_all_its_parameters_are_free(estimator):
    assert estimator.kernel.catalogue is CATALOGUE
    assert estimator.coordinates.free_names == estimator.kernel.parameters
