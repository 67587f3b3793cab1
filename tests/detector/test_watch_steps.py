"""A valve that its positioner moves in steps, sampled as a plant does: it jumps, sticks and creeps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from detector import Measurements, learn, learn_model
from detector.watch.force_balance import forces, sliding
from detector.watch.model.tuning import filter_for, tuned
from simulator import Value, ValveModel, kernel

STROKE, RATE, FINE = 0.03, 20, 50
_VALUES = {
    "mass.m": 2.6, "spring.K": 3.7e4, "spring.F0": 265.0, "lugre.fc": 28.0, "lugre.fs": 37.0, "lugre.vs": 3.4e-3,
    "lugre.sigma0": 1.9e6, "lugre.sigma1": 1.4e3, "lugre.sigma2": 160.0,
}  # fmt: skip
MODEL = ValveModel(
    effects=("inertia", "spring", "lugre"),
    parameters={name: Value(value=value, unit="") for name, value in _VALUES.items()},
    plant={"stroke_m": STROKE},
)


def stepped(seconds: float, seed: int, worn: float = 1.0) -> Measurements:
    """Force and position, 20 a second, of steps that a chamber fills to in 60 ms and an integral drives on slowly.

    worn : factor on the friction.
    """
    random, n = np.random.default_rng(seed), round(seconds * RATE * FINE)
    t = np.arange(n) / (RATE * FINE)
    lengths = random.uniform(1.5, 15.0, round(seconds / 1.5) + 2)
    steps = random.uniform(0.15, 0.85, len(lengths))[np.searchsorted(np.cumsum(lengths), t)]
    jumps = np.diff(steps, prepend=steps[0]) != 0
    since = t - np.maximum.accumulate(np.where(jumps, t, 0.0))
    away = np.sign(np.diff(steps, prepend=steps[0]))
    way = away[np.maximum.accumulate(np.where(jumps, np.arange(n), 0))]
    wanted = _VALUES["spring.F0"] + _VALUES["spring.K"] * STROKE * steps + way * (30.0 * worn + 1.5 * since)
    keep = np.exp(-1.0 / (RATE * FINE * 0.06))
    force = lfilter([1.0 - keep], [1.0, -keep], wanted, zi=[keep * wanted[0]])[0]
    values = _VALUES | {name: worn * _VALUES[name] for name in ("lugre.fc", "lugre.fs")}
    valve = kernel(MODEL.effects)
    start = valve.start((force[0] - values["spring.F0"]) / values["spring.K"], 0.0, float(force[0]))
    position = valve.run(t, force, valve.vector(values), start, h_max=1e-3).outputs[:, 0]
    kept = slice(None, None, FINE)
    noise = random.normal(size=(2, len(t[kept])))
    return Measurements(t[kept], {"position": position[kept] + 2e-6 * noise[0], "force": force[kept] + 0.3 * noise[1]})


@pytest.fixture(scope="module")
def healthy() -> Measurements:
    return stepped(400.0, seed=1)


def test_the_model_is_tuned_to_what_it_is(healthy):
    """The innovation runs away where the stem creeps at break-away, and a filter tuned on it loses the friction."""
    filter = tuned(filter_for(MODEL, healthy), healthy)
    for name in ("lugre.fc", "spring.K"):
        assert filter.values[name] == pytest.approx(_VALUES[name], rel=0.02)


def test_where_the_stem_slides_steadily_the_forces_are_those_of_the_model(healthy):
    filter = filter_for(MODEL, healthy)
    left = forces(sliding(filter, healthy))
    known = np.isfinite(left[:, 0])
    assert 0.02 < known.mean() < 0.6
    assert abs(np.median(left[known, 0])) < 0.05 * _VALUES["lugre.fc"]
    worn = forces(sliding(filter, stepped(100.0, seed=2, worn=1.6)))[:, 0]
    assert np.nanmedian(worn) == pytest.approx(0.6 * _VALUES["lugre.fs"], rel=0.1)  # it creeps at break-away


@pytest.mark.slow
def test_more_friction_is_found_and_named_and_a_healthy_valve_is_quiet(healthy):
    watch = learn(healthy, MODEL)
    assert not any(one.alarm for one in watch.run(watch.initial(), stepped(200.0, seed=3))[1])
    found = watch.run(watch.initial(), stepped(120.0, seed=4, worn=1.6))[1]
    assert any(one.began for one in found)
    assert found[-1].kind == "friction"


def fitted() -> ValveModel:
    """The model as a fit tells it whose data did not show how the bristle is damped."""
    parameters = {
        name: Value(value=value, unit="", std=0.01 * value, status="identified") for name, value in _VALUES.items()
    }
    parameters["lugre.sigma1"] = Value(value=3.0 * _VALUES["lugre.sigma1"], unit="", status="unresolved")
    told = {"noise": {"position_m": 2e-6, "force_N": 0.3}, "error": {"fit": {"rmse_m": 5e-5}}}
    return MODEL.model_copy(update={"parameters": parameters} | told)


@pytest.mark.slow
def test_from_the_model_alone_steps_are_no_fault_and_friction_grown_by_half_is():
    watch = learn_model(fitted(), 1.0 / RATE, {"position", "force"})
    for worn, seen in ((1.0, False), (1.5, True)):
        judgements = watch.run(watch.initial(), stepped(200.0, seed=2, worn=worn))[1]
        assert any(one.alarm for one in judgements) is seen
