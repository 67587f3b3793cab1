"""The weights of a predicted force: its errors in every second, and what the model misses throughout."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification import experiment
from identification.data.experiment import Experiment, imposed
from identification.estimators.imposed_motion.grid import imposed_grids, missed_square
from simulator import BASE, Excitation, Sensors, kernel, random_valve, simulate

TRUTH, STROKE = random_valve(7)
MOTION = kernel(BASE, "motion")
P = MOTION.vector(TRUTH)


@pytest.fixture(scope="module")
def rig() -> Experiment:
    """A rig that moves a valve by a staircase: rests and slips."""
    sensors = Sensors(250.0, position_noise=1e-4 * STROKE, force_noise=5e-4 * TRUTH["spring.K"] * STROKE)
    return imposed(experiment(simulate(TRUTH, Excitation.parse("staircase:20"), sensors, stroke=STROKE, seed=1)[0]))


def with_force(e: Experiment, amplitude: float) -> Experiment:
    """The same with a sine of 7 Hz in the force that no model knows of."""
    segments = tuple(replace(s, u=s.u + amplitude * np.sin(2 * np.pi * 7 * s.t)) for s in e.segments)
    return e.with_segments(segments)


def test_a_second_with_a_slip_has_larger_errors_than_a_rest(rig):
    (grid,) = imposed_grids([rig], MOTION, P)
    assert grid.force.std.max() > 2 * grid.force.std.min()
    assert grid.force.std.min() >= rig.noise_force
    assert all(len(set(grid.force.std[grid.block == number])) == 1 for number in set(grid.block))


def test_a_complete_model_misses_hardly_anything(rig):
    grids = imposed_grids([rig], MOTION, P)
    assert missed_square(grids, MOTION, P) < 0.2 * grids[0].floor ** 2


@pytest.mark.parametrize("factor", [3.0, 30.0])
def test_a_force_that_is_missing_throughout_is_measured(rig, factor):
    amplitude = factor * imposed_grids([rig], MOTION, P)[0].floor
    grids = imposed_grids([with_force(rig, amplitude)], MOTION, P)
    assert missed_square(grids, MOTION, P) == pytest.approx(amplitude**2 / 2, rel=0.15)


def test_a_force_in_some_seconds_only_is_not_missing_throughout(rig):
    amplitude = 10.0 * imposed_grids([rig], MOTION, P)[0].floor
    segments = tuple(
        replace(s, u=s.u + amplitude * np.sin(2 * np.pi * 7 * s.t) * (np.floor(s.t) % 3 == 0)) for s in rig.segments
    )
    grids = imposed_grids([rig.with_segments(segments)], MOTION, P)
    assert missed_square(grids, MOTION, P) < 0.01 * amplitude**2


def test_a_force_that_every_other_sample_knows_tells_as_much(rig):
    amplitude = 10.0 * imposed_grids([rig], MOTION, P)[0].floor
    e = with_force(rig, amplitude)
    segments = tuple(replace(s, seen=np.arange(len(s.t)) % 2 == 0) for s in e.segments)
    grids = imposed_grids([e.with_segments(segments)], MOTION, P)
    assert missed_square(grids, MOTION, P) == pytest.approx(amplitude**2 / 2, rel=0.15)


def test_beside_what_is_missing_the_errors_of_all_seconds_count_alike_and_their_mean_stays(rig):
    (grid,) = imposed_grids([rig], MOTION, P)
    mean = np.mean(grid.force.std[grid.counts] ** 2)
    assert grid.beside(0.0).force.std == pytest.approx(grid.force.std)
    for missed in (0.0, mean, 1e6 * mean):
        assert np.mean(grid.beside(missed).force.std[grid.counts] ** 2) == pytest.approx(mean)
    assert np.ptp(grid.beside(1e6 * mean).force.std) < 1e-3 * np.sqrt(mean)
