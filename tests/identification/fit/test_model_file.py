"""What a fit writes: `model.json` exactly as the contract has it, and the same valve when it is read back."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from seeded_valves import changed, recorded

from identification import Identification, identify
from recordings import Plant, Recording, read, write
from simulator import ValveModel, random_valve

SEED = 2
UNITS = {
    "mass.m": "kg", "spring.K": "N/m", "spring.F0": "N", "lugre.fc": "N", "lugre.fs": "N", "lugre.vs": "m/s",
    "lugre.sigma0": "N/m", "lugre.sigma1": "N s/m", "lugre.sigma2": "N s/m",
}  # fmt: skip


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> list[Path]:
    """Three recordings of one valve, as files."""
    folder = tmp_path_factory.mktemp("recordings")
    paths = [folder / f"{name}.h5" for name in ("one", "two", "three")]
    for path, excite in zip(paths, ("sine:8,step:4", "staircase:8", "step:6"), strict=True):
        recording = recorded(SEED, excite)
        plant = replace(recording.plant, tag="LC74_20", moving_mass_kg=random_valve(SEED)[0]["mass.m"])
        write(path, replace(recording, plant=plant))
    return paths


@pytest.fixture(scope="module")
def identified(files) -> Identification:
    return identify([read(path) for path in files[:2]], holdout=[read(files[2])])


@pytest.fixture(scope="module")
def content(identified, tmp_path_factory) -> dict:
    path = tmp_path_factory.mktemp("model") / "model.json"
    identified.model.write(path)
    return json.loads(path.read_text())


def test_it_has_the_items_of_the_contract_and_no_others(content):
    assert set(content) == {
        "format", "version", "effects", "parameters", "plant", "noise", "fitted_to", "error", "quality",
    }  # fmt: skip
    assert content["format"] == "valve-model"
    assert content["version"] == 1
    assert content["effects"] == ["inertia", "spring", "lugre"]


def test_every_parameter_has_value_deviation_unit_bounds_and_status(content):
    assert {name: item["unit"] for name, item in content["parameters"].items()} == UNITS
    for item in content["parameters"].values():
        assert {"value", "std", "unit", "lower", "upper", "status"} <= set(item)
        assert item["status"] in ("identified", "weak", "at_bound", "given")
        assert (item["std"] is None) == (item["status"] == "given")
        assert item["upper"] is None
    assert content["parameters"]["spring.F0"]["lower"] is None
    assert content["parameters"]["lugre.fc"]["lower"] == 0
    assert content["parameters"]["mass.m"]["status"] == "given"


def test_it_says_what_it_was_fitted_to(content, files):
    assert [item["file"] for item in content["fitted_to"]] == ["one.h5", "two.h5"]
    for item, path in zip(content["fitted_to"], files[:2], strict=True):
        assert item["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
        assert item["samples"] == len(read(path))


def test_errors_are_free_run_errors_of_both_sets(content, identified):
    noise = 1e-4 * random_valve(SEED)[1]
    for kind in ("fit", "holdout"):
        assert set(content["error"][kind]) == {"rmse_m", "nrmse"}
        assert content["error"][kind]["rmse_m"] == pytest.approx(noise, rel=0.1)
    (held_out,) = identified.holdout
    assert content["error"]["holdout"]["nrmse"] == pytest.approx(held_out.nrmse)
    assert held_out.rmse == pytest.approx(content["error"]["holdout"]["rmse_m"])


def test_a_recording_that_comes_later_gives_the_error_it_had_given_when_held_out(identified, files):
    (later,), (held_out,) = identified.on([read(files[2])]), identified.holdout
    assert later.unit == "m"
    np.testing.assert_allclose(later.simulated, held_out.simulated, atol=1e-12)


def test_plant_noise_and_quality_are_there(content, identified):
    assert content["plant"]["tag"] == "LC74_20"
    assert content["plant"]["stroke_m"] == random_valve(SEED)[1]
    assert content["noise"]["position_m"] == pytest.approx(1e-4 * random_valve(SEED)[1], rel=0.05)
    assert content["noise"]["force_N"] >= 0
    assert content["quality"]["outcome"] == "converged"
    assert content["quality"]["condition"] == pytest.approx(identified.uncertainty.condition)
    assert content["quality"]["crosscheck"] == identified.crosscheck.sentence


def test_what_is_written_is_what_is_read(identified, tmp_path):
    path = tmp_path / "model.json"
    identified.model.write(path)
    again = ValveModel.read(path)
    assert again == identified.model
    assert again.values == identified.fit.values


@pytest.mark.slow
def test_without_holdout_and_crosscheck_the_items_stay_and_are_empty(files, tmp_path):
    found = identify([read(files[2])], check=False, given={"lugre.sigma1": 500.0})
    found.model.write(tmp_path / "model.json")
    content = json.loads((tmp_path / "model.json").read_text())
    assert content["error"]["holdout"] is None
    assert content["quality"]["crosscheck"] is None


def test_a_holdout_in_which_nothing_moves_judges_without_a_relative_error(files, identified):
    still = changed(read(files[2]), position=np.full(len(read(files[2])), 0.01))
    found = identify([read(files[0])], holdout=[still], check=False)
    assert set(found.model.error["holdout"]) == {"rmse_m"}
    assert found.holdout[0].nrmse == float("inf")
    assert found.model.error["holdout"]["rmse_m"] > 100 * identified.model.error["holdout"]["rmse_m"]


def test_a_recording_that_came_from_no_file_has_no_hash():
    recording = recorded(SEED, "staircase:8")
    named = Recording.of(recording.signals.values(), plant=Plant(), title="from memory")
    (item,) = identify([named], check=False).model.fitted_to
    assert (item.file, item.sha256) == ("from memory", "")
