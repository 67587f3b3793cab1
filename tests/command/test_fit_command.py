"""`bristle fit` as a user types it: table, model file, report, and an exit code for every kind of answer."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from recordings import Plant, Recording, Signal, bundled, bundled_path, read_truth, write
from simulator import ValveModel

TRUTH = read_truth(bundled_path("step"))


@pytest.fixture
def folder(tmp_path):
    """A folder with recordings of the bundled valve in other clothes."""
    step = bundled("step")
    t, force, position = step["time"], step["force"], step["position"]
    pressure = Signal("pressure", force.values / 0.029 / 1e3, "kPa", "input")
    millimetres = Signal("position", 1e3 * position.values, "mm", "output")
    write(tmp_path / "pressure.h5", Recording.of([t, pressure, millimetres], plant=Plant(stroke_m=0.0381)))
    write(tmp_path / "no-force.h5", Recording.of([t, position]))
    write(tmp_path / "opposite.h5", Recording.of([t, replace(force, values=-force.values), position]))
    still = 0.01 + 1e-6 * np.random.default_rng(1).normal(size=len(t))
    write(tmp_path / "still.h5", Recording.of([t, force, replace(position, values=still)]))
    (tmp_path / "broken.h5").write_bytes(bundled_path("step").read_bytes()[:3000])
    return tmp_path


@pytest.mark.slow
def test_a_fit_prints_its_table_and_writes_the_model(console, tmp_path):
    out = tmp_path / "model.json"
    ending = console("fit", "bundled:step", "bundled:sine", "--holdout", "bundled:mixed", "--out", out)
    assert ending.code == 0
    assert ending.err == []
    assert "Identified valve" in ending.out
    assert all(name in ending.out for name in ("mass.m", "spring.K", "lugre.sigma2", "identified", "N s/m"))
    assert "free-run error, fit: rmse_m" in ending.out
    assert "free-run error, holdout: rmse_m" in ending.out
    assert "sparse regression agrees with the fit in steady sliding" in ending.out
    assert "friction rising" in ending.out
    model = ValveModel.read(out)
    for name, parameter in model.parameters.items():
        assert abs(parameter.value - TRUTH[name]) < 4.5 * parameter.std
    assert [item.file for item in model.fitted_to] == ["step.h5", "sine.h5"]


def test_pressure_needs_an_area_and_an_option_gives_it(console, folder):
    assert "--area" in console.refused("fit", folder / "pressure.h5")
    out = folder / "model.json"
    ending = console("fit", folder / "pressure.h5", "--area", 0.029, "--no-crosscheck", "--out", out)
    assert ending.code == 0
    model = ValveModel.read(out)
    assert model.values["spring.K"] == pytest.approx(TRUTH["spring.K"], rel=1e-3)
    assert model.plant["diaphragm_area_m2"] == 0.029


@pytest.mark.slow
def test_given_parameters_are_held_and_profiles_printed(console, tmp_path):
    out = tmp_path / "model.json"
    words = ("--given", "mass.m=2", "--given", "lugre.sigma1=2000", "--profile", "lugre.fc", "--no-crosscheck")
    ending = console("fit", "bundled:step", *words, "--out", out)
    assert ending.code == 0
    model = ValveModel.read(out)
    assert model.parameters["mass.m"].status == model.parameters["lugre.sigma1"].status == "given"
    assert model.values["lugre.sigma1"] == 2000
    (line,) = [line for line in ending.out.splitlines() if line.startswith("profile of lugre.fc")]
    low, high = (float(word) for word in line.split("interval from ")[1].split(" to "))
    assert low < model.values["lugre.fc"] < high


@pytest.mark.slow
def test_a_wrong_constant_is_a_negative_answer_with_its_model_written(console, tmp_path):
    out, sine = tmp_path / "model.json", bundled("sine")
    slower = [
        replace(sine[name], values=sine[name].values[: len(sine) // 2 : 2]) for name in ("time", "force", "position")
    ]
    write(tmp_path / "sine.h5", Recording.of(slower))
    ending = console("fit", tmp_path / "sine.h5", "--given", f"spring.K={1.1 * TRUTH['spring.K']}", "--out", out)
    assert ending.code == 1
    assert "sparse regression disagrees" in ending.out
    assert "times the noise" in ending.out
    assert json.loads(out.read_text())["quality"]["crosscheck"].startswith("sparse regression disagrees")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("still.h5", "the valve does not move"),
        pytest.param("opposite.h5", "check units, signs and roles", marks=pytest.mark.slow),
    ],
)
def test_data_that_teach_nothing_end_with_1_and_the_sentence(console, folder, name, words):
    ending = console("fit", folder / name)
    assert ending.code == 1
    assert words in ending.complaint


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.h5"], "nowhere.h5"),
        (["bundled:nope"], "there are mixed, sine, step"),
        (["broken.h5"], "broken.h5"),
        (["no-force.h5"], "no force"),
        (["bundled:step", "--given", "mass.m"], "NAME=NUMBER"),
        (["bundled:step", "--given", "mass.m=heavy"], "NAME=NUMBER"),
        (["bundled:step", "--given", "mass.m=inf"], "NAME=NUMBER"),
        (["bundled:step", "--given", "mass.q=1"], "no such parameter"),
        (["bundled:step", "--given", "lugre.fc=-5"], "lugre.fc"),
        (["bundled:step", "--without", "lugre"], "--without lugre"),
        (["bundled:step", "--causality", "sideways"], "--causality sideways"),
        (["bundled:step", "--area", "-1"], "diaphragm_area_m2"),
        (["bundled:step", "--out", "nowhere/m.json"], "no folder"),
        (["bundled:step", "--report", "nowhere/m.html"], "no folder"),
        (["bundled:step", "--out", "."], "it is a directory"),
        (["bundled:step", "--profile", "lugre.qq"], "--profile lugre.qq"),
        (["bundled:step", "--given", "mass.m=2", "--profile", "mass.m"], "--profile mass.m"),
        (["bundled:step", "--holdout", "nowhere.h5"], "nowhere.h5"),
        (["bundled:step", "bundled:step"], "which is fitted already; it would count twice: give it once"),
        (["bundled:step", "--holdout", "bundled:step"], "it is fitted and held out; what is fitted does not judge"),
        (
            ["bundled:step", "--repeats"],
            "--repeats: one recording has no spread; give 2 or more",
        ),
        (["bundled:step", "bundled:sine", "--compare", "--repeats"], "--repeats"),
    ],
)
def test_what_cannot_be_used_is_refused_before_the_work(console, folder, monkeypatch, words, said):
    monkeypatch.chdir(folder)
    assert said in console.refused("fit", *words)


@pytest.mark.slow
def test_a_drive_without_a_spring_and_a_rig_are_options(console, folder):
    step = bundled("step")
    rig = [step["time"], replace(step["position"], role="input"), replace(step["force"], role="output")]
    write(folder / "rig.h5", Recording.of(rig))
    out = folder / "model.json"
    assert console("fit", folder / "rig.h5", "--no-crosscheck", "--out", out).code in (0, 1)
    assert json.loads(out.read_text())["quality"]["causality"] == "motion"
    assert console("fit", folder / "rig.h5", "--no-crosscheck", "--causality", "force", "--out", out).code == 0
    assert json.loads(out.read_text())["quality"]["causality"] == "force"
    assert console("fit", "bundled:step", "--without", "spring", "--no-crosscheck", "--out", out).code in (0, 1)
    assert json.loads(out.read_text())["parameters"]["spring.K"] == {
        "value": 0.0, "std": None, "unit": "N/m", "lower": 0.0, "upper": None, "status": "given", "note": None,
    }  # fmt: skip


def test_several_holdouts_may_follow_one_option(console, tmp_path):
    out = tmp_path / "model.json"
    words = ("--holdout", "bundled:sine", "bundled:mixed", "--no-crosscheck", "--out", out)
    assert console("fit", "bundled:step", *words).code == 0
    model = ValveModel.read(out)
    assert [item.file for item in model.fitted_to] == ["step.h5"]
    assert 2e-6 < model.error["holdout"]["rmse_m"] < 5e-5


def test_a_report_is_written_beside_the_model(console, tmp_path):
    page = tmp_path / "fit.html"
    assert console("fit", "bundled:step", "--report", page, "--no-crosscheck").code == 0
    assert page.read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html>")


@pytest.mark.slow
def test_repeats_of_one_test_say_their_spread_beside_the_intervals(console, tmp_path):
    step = bundled("step")
    for day in (1, 2):
        noise = 2e-6 * np.random.default_rng(day).normal(size=len(step))
        position = replace(step["position"], values=step["position"].values + noise)
        write(tmp_path / f"day{day}.h5", Recording.of([step["time"], step["force"], position]))
    out, days = tmp_path / "model.json", [tmp_path / f"day{day}.h5" for day in (1, 2)]
    ending = console("fit", *days, "--repeats", "--no-crosscheck", "--out", out)
    assert ending.code == 0
    assert "± repeats" in ending.out
    assert any("lugre.fc" in line and "(2)" in line for line in ending.out.splitlines())
    (said,) = json.loads(out.read_text())["quality"]["repeats"]["sentences"]
    assert said in ending.out
    assert said in console("show", out).out
