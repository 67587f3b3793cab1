"""An effect of one's own: simulated, stored and read through a catalogue that extends the toolkit's."""

from __future__ import annotations

import copy
import json
import pickle

import numpy as np
import pytest
from sample_effects import Drag, InputLag

from recordings import BadInput
from simulator import BASE, CATALOGUE, Catalogue, Excitation, Sensors, Value, ValveModel, kernel, random_valve, simulate

OURS = CATALOGUE.extended(Drag())
VALUES, STROKE = random_valve(2)
STEPS = Excitation.parse("staircase:2")


def simulated(drag: float | None):
    """The position with a drag of some size, or without the effect."""
    effects = BASE if drag is None else (*BASE, "sample_drag")
    values = VALUES if drag is None else VALUES | {"sample_drag.c": drag}
    recording, truth = simulate(values, STEPS, Sensors(), stroke=STROKE, effects=effects, catalogue=OURS)
    assert truth["effects"] == " ".join(effects)
    return recording["position"].values


def test_it_is_simulated_and_the_global_catalogue_stays_as_it_is():
    before = CATALOGUE.ids
    assert np.array_equal(simulated(0.0), simulated(None))
    slowed = np.abs(simulated(5e4) - simulated(None))
    assert 1e-4 * STROKE < slowed.max() < STROKE
    assert CATALOGUE.ids == before
    assert "sample_drag" not in CATALOGUE


def test_without_its_catalogue_it_is_unknown():
    with pytest.raises(KeyError, match="no effect named 'sample_drag'"):
        simulate(VALUES | {"sample_drag.c": 1.0}, STEPS, Sensors(), stroke=STROKE, effects=(*BASE, "sample_drag"))


def test_its_bounds_are_kept():
    with pytest.raises(BadInput, match=r"sample_drag\.c = -1"):
        simulated(-1.0)


def test_a_kernel_knows_its_catalogue_and_what_its_effects_declare():
    k = kernel((*BASE, "sample_drag"), catalogue=OURS)
    assert k.catalogue == OURS
    assert kernel(BASE).catalogue == CATALOGUE
    assert tuple(OURS.parameters(k.effects)) == k.parameters
    assert OURS.parameters(k.effects)["sample_drag.c"] is Drag.parameters[0]


def test_kernels_are_compiled_once_for_all_catalogues():
    chosen = (
        *BASE,
        "force_gain",
        "sensor_lag",
        "sensor_drift",
    )  # in no other test: older kernels may have been dropped
    ours, theirs = kernel(chosen, catalogue=OURS), kernel(chosen)
    assert ours is kernel(chosen, catalogue=OURS)
    assert ours is not theirs
    assert ours.scanner is theirs.scanner


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))], ids=["copy", "pickle"])
def test_a_copied_catalogue_finds_the_same_kernels(copied):
    again = copied(OURS)
    assert again is not OURS
    assert again == OURS
    assert kernel((*BASE, "sample_drag"), catalogue=again) is kernel((*BASE, "sample_drag"), catalogue=OURS)


def test_effects_differ_by_their_class_and_by_what_they_were_given():
    class Tuned(Drag):
        def __init__(self, power: float) -> None:
            self.power = power

    assert Tuned(2.0) == Tuned(2.0)
    assert Tuned(2.0) != Tuned(3.0)
    assert Tuned(2.0) != Drag()
    assert Drag() != "sample_drag"


def test_effects_of_ones_own_stand_at_the_end_or_where_one_puts_them():
    assert CATALOGUE.extended(Drag(), InputLag()).ids == (*CATALOGUE.ids, "sample_drag", "sample_input_lag")
    effects = list(CATALOGUE.effects)
    effects.insert(len(BASE), Drag())
    assert Catalogue(tuple(effects)).ids.index("sample_drag") == len(BASE)


def test_a_model_with_it_is_stored_and_read(tmp_path):
    units = {name: p.unit for name, p in OURS.parameters((*BASE, "sample_drag")).items()}
    values = VALUES | {"sample_drag.c": 5e3}
    model = ValveModel(
        effects=(*BASE, "sample_drag"),
        parameters={name: Value(value=value, unit=units[name]) for name, value in values.items()},
    )
    model.write(tmp_path / "model.json")
    assert ValveModel.read(tmp_path / "model.json", OURS) == model
    with pytest.raises(BadInput, match="there is no effect 'sample_drag'"):
        ValveModel.read(tmp_path / "model.json")
    content = json.loads((tmp_path / "model.json").read_text())
    content["parameters"]["sample_drag.c"]["value"] = -1.0
    (tmp_path / "model.json").write_text(json.dumps(content))
    with pytest.raises(BadInput, match=r"parameters\.sample_drag\.c"):
        ValveModel.read(tmp_path / "model.json", OURS)
