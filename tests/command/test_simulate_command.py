"""`bristle simulate`: a recording of a valve, with the truth beside it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from recordings import bundled, read, read_truth
from simulator import random_valve


def test_it_writes_a_valid_recording_with_its_truth(console, tmp_path):
    path = tmp_path / "rec.h5"
    ending = console("simulate", "--to", path, "--excite", "step:2,sine:3", "--seed", 4, "--position-noise", 1e-6)
    assert ending.code == 0
    assert ending.err == []
    assert ending.out == f"{path}: 2501 samples, 5 s\n"
    recording, truth = read(path), read_truth(path)
    values, stroke = random_valve(4)
    assert set(recording) == {"time", "force", "position"}
    assert recording.source == "simulated"
    assert recording.plant.stroke_m == stroke
    assert {name: truth[name] for name in values} == values
    assert np.std(recording["position"].values - truth["position"]) == pytest.approx(1e-6, rel=0.1)


def test_a_seed_repeats_the_file_and_options_change_the_valve(console, tmp_path):
    for name, more in (("a", []), ("b", []), ("c", ["--given", "lugre.fc=77", "--given", "lugre.fs=99"])):
        assert console("simulate", "--to", tmp_path / f"{name}.h5", "--excite", "sine:2", *more).code == 0
    first, again, other = (read(tmp_path / f"{name}.h5") for name in "abc")
    assert np.array_equal(first["position"].values, again["position"].values)
    assert not np.array_equal(first["position"].values, other["position"].values)
    assert read_truth(tmp_path / "c.h5")["lugre.fc"] == 77


def test_sensors_are_as_asked(console, tmp_path):
    path = tmp_path / "rec.h5"
    options = {"rate": 200, "position-noise": 2e-6, "force-noise": 0.5, "position-step": 1e-5, "force-step": 0.25}
    words = [word for name, value in options.items() for word in (f"--{name}", value)]
    assert console("simulate", "--to", path, "--excite", "sine:4", *words).code == 0
    recording = read(path)
    assert len(recording) == 801
    assert (recording["position"].resolution, recording["position"].noise_std) == (1e-5, 2e-6)
    assert (recording["force"].resolution, recording["force"].noise_std) == (0.25, 0.5)


def test_a_model_is_simulated(console, tmp_path):
    model, path = tmp_path / "model.json", tmp_path / "rec.h5"
    assert console("fit", "bundled:step", "--out", model, "--no-crosscheck").code == 0
    assert console("simulate", "--to", path, "--valve", model, "--excite", "sine:2").code == 0
    stored = json.loads(model.read_text())
    assert read_truth(path)["spring.K"] == stored["parameters"]["spring.K"]["value"]
    assert read(path).plant.stroke_m == bundled("step").plant.stroke_m


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--excite", "wobble:3"], "wobble"),
        (["--excite", "sine:abc"], "abc"),
        (["--excite", "positioner:5,sine:5"], "positioner"),
        (["--rate", "0"], "rate"),
        (["--rate", "1e12"], "samples"),
        (["--stroke", "-1"], "--stroke"),
        (["--position-noise", "-1"], "position noise"),
        (["--force-step", "-1"], "force step"),
        (["--given", "lugre.xx=3"], "lugre.xx"),
        (["--given", "lugre.fc"], "NAME=NUMBER"),
        (["--given", "lugre.fc=nan"], "NAME=NUMBER"),
        (["--given", "lugre.fc=-5"], "lugre.fc"),
        (["--valve", "nowhere.json"], "nowhere.json"),
        (["--scenario", "nothing"], "nothing"),
        (["--scenario", "healthy", "--friction", "glue"], "glue"),
    ],
)
def test_what_cannot_be_simulated_is_refused_and_nothing_is_written(console, tmp_path, words, said):
    complaint = console.refused("simulate", "--to", tmp_path / "rec.h5", *words)
    assert said in complaint
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_is_refused(console, tmp_path):
    assert "no folder" in console.refused("simulate", "--to", tmp_path / "nowhere" / "rec.h5")
    assert "directory" in console.refused("simulate", "--to", tmp_path, "--excite", "sine:1")


def test_a_scenario_of_the_benchmark_is_written(console, tmp_path):
    path = tmp_path / "f7.h5"
    ending = console("simulate", "--to", path, "--scenario", "f7-abrupt-medium", "--duration", 20)
    assert ending.code == 0
    assert len(read(path)) > 1
