"""New paths of a valve whose sensor does not show where the stem is: they are read as what was recorded."""

from __future__ import annotations

import numpy as np
import pytest
from stiff_valves import STIFF, stem_test

from identification import experiment
from identification.data.grid import grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.linearised_model import first_path, ran_along
from simulator import BASE, kernel

SENSORS = {"backlash": {"backlash.width": 4e-4}, "sensor_lag": {"sensor_lag.tau": 0.04}}
"""A play of a hundredth of the stroke, and a lag of four samples."""


@pytest.fixture(scope="module", params=SENSORS)
def sensor(request):
    """The fit of a stem test behind a sensor, and its true values."""
    effects, values = (*BASE, request.param), STIFF | SENSORS[request.param]
    known = grids([experiment(r) for r in stem_test(100.0, ("sine:20",), values=values, effects=effects)])
    coordinates = Coordinates.of(kernel(effects), {}, 700.0)
    theta = coordinates.theta_of(values)
    return noise_aware_for(kernel(effects), coordinates, known, [theta], "damped"), theta


def test_a_path_along_the_recorded_motion_is_read_as_that(sensor):
    whole, theta = sensor
    [grid], p = whole.grids, whole.coordinates.p(theta)
    path = first_path(whole.kernel, grid, p)
    assert path is not None
    apart = path[:, 0] - grid.motion[:, 0]
    read = ran_along(whole.kernel, grid.t, grid.force.u, p, path.copy())
    assert np.std(read - grid.motion[:, 0]) < 0.4 * np.std(apart)
    assert np.std(apart) > 5e-5


def test_a_start_at_the_true_values_explains_the_recording(sensor):
    whole, theta = sensor
    start = whole.start(theta)
    assert start is not None
    assert start.loss < 1.3
    assert start.outliers < 5e-3


@pytest.mark.slow
def test_a_refit_leaves_paths_of_other_parameters_that_slip_late():
    """Those of a model without the delay are nearer to the measurements than new ones, until both come to rest."""
    effects, values = (*BASE, "dead_time"), STIFF | {"dead_time.tau": 0.06}
    known = grids([experiment(r) for r in stem_test(100.0, ("sine:20",), values=values, effects=effects)])
    coordinates = Coordinates.of(kernel(effects), {}, 700.0)
    theta, undelayed = (coordinates.theta_of(values | some) for some in ({}, {"dead_time.tau": 1e-6}))
    work = noise_aware_for(kernel(effects), coordinates, known, [theta], "damped")
    new, other = work.start(theta), work.start(undelayed)
    assert new is not None
    assert other is not None
    assert new.loss < 1.3
    assert other.cost > new.cost + 1e5
    end = work.refit(theta, other.paths, 0)
    assert end is not None
    assert end.loss < new.loss + 0.2


@pytest.mark.slow
def test_a_descent_chooses_paths_at_every_step_so_that_slips_are_not_lost():
    """Moved along with the parameters they gain what a step promises, too, and still lose hundreds by its end."""
    effects, values = (*BASE, "hardening_spring"), STIFF | {"hardening_spring.k3": 3e5}
    recordings = stem_test(200.0, ("sine:20", "staircase:20"), values=values, effects=effects)
    known = grids([experiment(r) for r in recordings])
    coordinates = Coordinates.of(kernel(effects), {}, 700.0)
    theta, linear = (coordinates.theta_of(values | some) for some in ({}, {"hardening_spring.k3": 0.0}))
    work = noise_aware_for(kernel(effects), coordinates, known, [theta], "damped")
    right, wrong = work.start(theta), work.start(linear)
    assert right is not None
    assert wrong is not None
    start = work.along(linear, wrong.paths, 0)
    assert start is not None
    assert work.descend(start, 12).cost < work.descended(right).cost + 150
