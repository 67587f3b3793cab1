"""The innovation of the identified model, with every effect that a model may have, and its derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from watched_valve import MODEL, seen

from detector import Measurements, learn
from detector.watch.model.filter import DIRECTIONS, SUBSTEP
from detector.watch.model.innovations import innovations
from detector.watch.model.tuning import filter_for, tuned
from simulator import BASE, CATALOGUE, Value, ValveModel, kernel

EXTRA = [effect for effect in CATALOGUE.effects if effect.id not in BASE]


@pytest.fixture(scope="module")
def healthy():
    return seen(120.0, seed=1)


def with_effect(effect) -> ValveModel:
    """The model with one more effect, of neutral or typical size."""
    more = {
        effect.parameter_name(p.symbol): Value(value=p.scale if p.neutral is None else p.neutral, unit=p.unit)
        for p in effect.parameters
    }
    return MODEL.model_copy(update={"effects": (*MODEL.effects, effect.id), "parameters": {**MODEL.parameters, **more}})


@pytest.mark.parametrize("effect", EXTRA, ids=lambda effect: effect.id)
def test_the_filter_follows_a_model_with_any_added_effect(effect, healthy):
    filter = filter_for(with_effect(effect), healthy)
    run = innovations(filter, healthy[:300])
    assert np.isfinite(run.value).all()
    assert np.isfinite(run.slope).all()
    assert (run.variance > 0).all()
    assert np.std(run.value) < 1e-3  # neutral, the effect leaves the filter as good as it was: millimetres of 38


def test_tuning_finds_what_the_flow_adds_and_makes_the_innovation_small(healthy):
    raw = filter_for(MODEL, healthy)
    filter = tuned(raw, healthy)
    assert 1.10e5 < filter.values["spring.K"] < 1.25e5  # the flow adds to the spring's 60 892 N/m
    before, after = (np.mean(innovations(one, healthy).value[100:] ** 2) for one in (raw, filter))
    assert after < 0.5 * before


def of_the_model(filter, data: Measurements) -> Measurements:
    """The data with the position that the model itself gives: the innovation of its filter is zero then."""
    model = kernel(filter.effects)
    force = np.array([filter.net_force(row) for row in data])
    start = filter.start(next(iter(data))).state
    position = model.run(data.time_s, force, model.vector(filter.values), start, h_max=SUBSTEP).outputs[:, 0]
    return Measurements(data.time_s, {**data.values, "position": position})


@pytest.mark.parametrize("number", range(len(DIRECTIONS)), ids=DIRECTIONS)
def test_derivatives_by_the_directions_are_those_of_differences(number, healthy):
    filter = tuned(filter_for(MODEL, healthy), healthy)
    part = of_the_model(filter, healthy[:160])
    assert np.abs(innovations(filter, part).value).max() < 1e-9
    step = (1e-5, 1e-6, 1e-2)[number]
    names = (("lugre.fc", "lugre.fs"), ("spring.K", "spring.F0"), ("spring.F0",))[number]

    def value(way: float) -> np.ndarray:
        size = {name: 1.0 if number == 2 else filter.values[name] for name in names}
        changed = {name: filter.values[name] + way * step * size[name] for name in names}
        return innovations(replace(filter, values={**filter.values, **changed}), part).value

    # The plant with a change against the filter's model is the filter with the opposite change against the plant.
    numeric = -(value(1.0) - value(-1.0)) / (2.0 * step)
    exact = innovations(filter, part).slope[:, number]
    assert numeric == pytest.approx(exact, abs=0.02 * np.abs(exact).max())


def test_a_model_without_pressure_or_area_is_not_used(healthy):
    bare = MODEL.model_copy(update={"plant": {}})
    assert filter_for(bare, healthy) is None
    assert learn(healthy, bare).model is None
