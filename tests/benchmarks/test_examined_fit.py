"""A fit of what the examination records: a valve behind a positioner, which creeps below break-away for seconds."""

from __future__ import annotations

import numpy as np

from benchmarks.examination import draws
from benchmarks.examination.plant import run
from benchmarks.examination.subjects import TRUTH
from identification import experiment
from identification.data.grid import grids
from identification.estimators import Coordinates
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.search import RIGHT
from simulator import BASE, kernel

CREEPING = 9100
"""Seed of a valve whose positioner makes it creep: three of its chunks in six held it before break-away or after."""


def test_paths_stay_with_a_stem_that_creeps_below_break_away():
    """A run of the model does not: an error of the force that nobody can measure makes it slip."""
    rng = np.random.default_rng([CREEPING, 0])
    valve = draws.valve(rng)
    raw = run(valve, draws.setpoint(valve.stroke, 60.0, "steps", rng), rng)
    e = experiment(draws.measured(valve, raw, 100.0, rng))
    truth = {name: float(getattr(valve, field)) for name, field in TRUTH.items()}
    coordinates = Coordinates.of(kernel(BASE), {}, float(np.std(e.segments[0].u)))
    theta = coordinates.theta_of(truth)
    estimate = noise_aware_for(kernel(BASE), coordinates, grids([e]), [theta], "damped").start(theta)
    assert estimate is not None
    assert estimate.loss < RIGHT
    assert estimate.outliers < 2e-3
