"""Tracing where the sampling does not resolve the bristle: in damped order, from the fit that `identify` makes."""

from __future__ import annotations

import time

import numpy as np
import pytest
from stiff_valves import STIFF, stem_test

from identification import Trace, experiment, trace
from identification.data.grid import grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.search import RIGHT
from recordings import Recording
from simulator import BASE, CATALOGUE, Catalogue, kernel

SPOT = {"a": 0.6, "b": 0.0, "x0": 0.02, "w": 0.003}
"""Friction rises by 60 % in a bell of 3 mm at 20 mm."""
EFFECT = "position_dependent_friction"
BOTH = {"hardening_spring": {"k3": 3e5}, "friction_drift": {"r": 5e-4}}
"""A spring that hardens while friction drifts."""


def with_spring_and_drift() -> list[Recording]:
    """The recordings of a stem test of a stiff valve with both, at 100 Hz."""
    effects = tuple(e for e in CATALOGUE.ids if e in (*BASE, *BOTH))
    values = {f"{effect}.{name}": value for effect, values in BOTH.items() for name, value in values.items()}
    return stem_test(100.0, ("staircase:20", "sine:20", "multisine:20"), values=values, effects=effects)


def with_tight_spot(rate: float) -> list[Recording]:
    """The recordings of a stem test of a stiff valve with a tight spot, at a rate [Hz]."""
    effects = tuple(e for e in CATALOGUE.ids if e in (*BASE, EFFECT))
    return stem_test(rate, values={f"{EFFECT}.{name}": value for name, value in SPOT.items()}, effects=effects)


def told(recordings: list[Recording]) -> Trace:
    """A trace of some recordings, and what it took, printed."""
    start = time.process_time()
    found = trace(recordings)
    errors = [(found.error[side]["report"] or {}).get("rmse_m") for side in ("before", "after")]
    print(found.verdict, found.values, "free-run error [m]:", errors, f"{time.process_time() - start:.0f} s")
    return found


def test_a_recording_that_begins_near_break_away_rests_there():
    """Between Coulomb and static friction, where a bristle that holds no more than Coulomb friction would creep."""
    [sine] = stem_test(200.0, ("sine:90",))
    [segment] = experiment(sine).segments
    held = np.abs(segment.u - STIFF["spring.K"] * segment.motion.x - STIFF["spring.F0"]) / STIFF["lugre.fc"]
    near = int(np.flatnonzero((segment.motion.crept == 0.0) & (held > 1.2))[0])
    assert held[near] < STIFF["lugre.fs"] / STIFF["lugre.fc"]
    e = experiment(sine).with_segments((segment.part(near, near + 400),))
    coordinates = Coordinates.of(kernel(BASE), {}, 700.0)
    theta = coordinates.theta_of(STIFF)
    estimate = noise_aware_for(kernel(BASE), coordinates, grids([e]), [theta], "damped").start(theta, 10)
    assert estimate is not None
    assert estimate.loss < RIGHT


@pytest.mark.slow
def test_of_all_effects_of_a_catalogue_the_one_is_named_without_which_most_is_lost():
    *fitted, held = with_spring_and_drift()
    catalogue = Catalogue(tuple(CATALOGUE[effect] for effect in (*BASE, *BOTH)))
    found = trace(fitted, holdout=[held], catalogue=catalogue)
    left = {effect: found.selection.final.without(effect) for effect in BOTH}
    assert set(found.effects_added) == set(BOTH)
    assert found.verdict == found.effects_added[0] == max(BOTH, key=lambda effect: left[effect].cost)


@pytest.mark.slow
def test_two_effects_are_named_where_the_first_leaves_hardly_more_than_noise():
    """The drift gains some hundreds beside the spring, far less than other ends of the model may in damped order."""
    *fitted, held = with_spring_and_drift()
    found = trace(fitted, holdout=[held])
    assert found.selection.base.data.damped is not None
    assert set(found.effects_added) == set(BOTH)
    assert found.values["friction_drift.r"] == pytest.approx(5e-4, rel=0.3)
    assert found.values["hardening_spring.k3"] == pytest.approx(3e5, rel=0.1)


@pytest.mark.long
def test_a_tight_spot_is_named_with_its_place():
    found = told(with_tight_spot(200.0))
    assert found.effects_added == (EFFECT,)
    assert found.values[f"{EFFECT}.x0"] == pytest.approx(SPOT["x0"], abs=3e-4)
    assert found.values[f"{EFFECT}.a"] == pytest.approx(SPOT["a"], rel=0.02)


@pytest.mark.long
def test_the_same_valve_without_one_lacks_nothing():
    assert told(stem_test(200.0)).verdict == "none"
