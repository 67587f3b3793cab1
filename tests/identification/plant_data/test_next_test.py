"""The next test: it keeps its limits, teaches more than the usual tests, and its promise holds when it is run."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bristle.cli.app import run
from identification.next_test import (
    WAVEFORMS,
    DesignBounds,
    NextTest,
    bounds_of,
    known_valve,
    models_of,
    models_of_trace,
    next_test,
)
from recordings import BadInput, BadParameter
from simulator import BASE, CATALOGUE, Value, ValveModel, kernel, random_valve

NOISE = 5e-6


def model_of(seed: int, weak: tuple[str, ...] = (), **added: float) -> ValveModel:
    """The valve of a seed as a fit would know it: some parameters weak, the others to 2 %."""
    values, stroke = random_valve(seed)
    values |= {name.replace("__", "."): value for name, value in added.items()}
    effects = (*BASE, *dict.fromkeys(name.partition("__")[0] for name in added))
    parameters = {
        name: Value(
            value=values[name], unit=one.unit, std=abs(values[name]) * (0.6 if name in weak else 0.02),
            status="weak" if name in weak else "identified",
        )
        for name, one in CATALOGUE.parameters(effects).items()
    }  # fmt: skip
    plant = {"stroke_m": stroke, "diaphragm_area_m2": 0.01}
    return ValveModel(effects=effects, parameters=parameters, plant=plant, noise={"position_m": NOISE})


BOUNDS = DesignBounds(travel=(20.0, 80.0), rate=25.0, duration=4.0)


@pytest.fixture(scope="module")
def proposed() -> NextTest:
    return next_test({"valve": model_of(3, ("lugre.vs",))}, BOUNDS, sampling=50.0, bends=4)


def test_a_test_keeps_its_limits(proposed):
    values, stroke = proposed.valves[0].values, proposed.valves[0].stroke
    force = proposed.sequence * 1e3 * 0.01
    assert proposed.column == "pressure_kPa"
    assert proposed.t[-1] == 4.0
    assert np.abs(np.diff(force)).max() / 0.02 <= 0.25 * values["spring.K"] * stroke * 1.001
    path = proposed.expected.paths["valve"] / stroke
    assert 0.19 < path.min() < path.max() < 0.81


def test_it_teaches_more_than_the_usual_tests(proposed):
    assert proposed.weak == ("lugre.vs",)
    for reference in proposed.references.values():
        assert proposed.expected.std["lugre.vs"] <= reference.std["lugre.vs"]
    assert proposed.settles


def test_a_poor_value_of_a_weak_parameter_does_not_rule_the_design():
    """Valves that one may be lie nearer to what is usual than a value that nothing supports."""
    model = model_of(3, ("lugre.vs",))
    poor = model.parameters["lugre.vs"].model_copy(update={"value": 0.6, "std": 3.0})
    poor_model = model.model_copy(update={"parameters": {**model.parameters, "lugre.vs": poor}})
    supposed = known_valve("valve", poor_model).supposed(4)
    values = [one.values for one in supposed]
    assert len({one["lugre.vs"] for one in values}) == 4
    assert all(one["lugre.vs"] < 0.6 for one in values)
    assert [one["spring.K"] for one in values] == pytest.approx([model.values["spring.K"]] * 4)


def test_references_keep_the_limits_too(proposed):
    valve = proposed.valves[0]
    for sequence in proposed.reference_sequences.values():
        force = sequence * 1e3 * 0.01
        path = kernel(BASE).run(proposed.t, force, valve.p, valve.at_rest(float(force[0])), h_max=2.5e-4).outputs[:, 0]
        assert 0.19 < path.min() / valve.stroke < path.max() / valve.stroke < 0.81


@pytest.mark.parametrize("name", WAVEFORMS)
def test_no_sequence_is_quicker_than_the_sampling(name):
    """The shape of most and quickest swings turns at most twice in twenty samples."""
    n = 400
    wave = WAVEFORMS[name](np.arange(n + 1) / n, np.array([1.0, 1.0, 1.0]))
    step = np.sign(np.diff(wave))
    turns = np.count_nonzero(np.diff(step[step != 0]))
    assert 0 < turns <= 2 * n / 20 + 1


def test_its_promise_holds_when_it_is_run(proposed):
    """Three expected standard deviations away the free run differs by more than noise does."""
    valve = proposed.valves[0]
    force = proposed.sequence * 1e3 * 0.01
    model, start = kernel(BASE), valve.at_rest(float(force[0]))
    moved = valve.values | {"lugre.vs": valve.values["lugre.vs"] + 3 * proposed.expected.std["lugre.vs"]}
    paths = [
        model.run(proposed.t, force, model.vector(values), start, h_max=2.5e-4).outputs[:, 0]
        for values in (valve.values, moved)
    ]
    assert np.linalg.norm(paths[0] - paths[1]) / NOISE > 2.0


@pytest.mark.slow
def test_rivals_are_told_by_distance():
    rivals = {
        "backlash": model_of(4, backlash__width=2e-4),
        "hardening_spring": model_of(4, hardening_spring__k3=1e7),
    }
    found = next_test(rivals, BOUNDS, drive="force", sampling=50.0, bends=2)
    assert found.expected.distance == found.expected.distances["backlash", "hardening_spring"]
    assert found.settles == (found.expected.distance >= 5.0)
    assert "noise sigmas apart" in found.lines()[1]
    assert found.as_json()["for"] == ["backlash", "hardening_spring"]


def test_a_set_point_goes_through_a_positioner():
    bounds = DesignBounds(travel=(20.0, 80.0), duration=1.0)
    found = next_test({"valve": model_of(3, ("lugre.vs",))}, bounds, drive="setpoint", sampling=50.0, bends=1)
    assert found.column == "setpoint_percent"
    assert 20.0 <= found.sequence.min() <= found.sequence.max() <= 80.0


@pytest.mark.browser
def test_the_page_prints_on_a4_with_nothing_cut(browser, tmp_path):
    bounds = DesignBounds(travel=(30.0, 70.0), duration=1.0, pressure=(1.0, 300.0))
    next_test({"valve": model_of(3, ("lugre.vs",))}, bounds, sampling=50.0, bends=1).report(tmp_path / "page.html")
    assert browser.lost_on_a4(tmp_path / "page.html") == []


def test_the_command_writes_sequence_and_page(tmp_path, capsys):
    model, out, page = tmp_path / "model.json", tmp_path / "sequence.csv", tmp_path / "page.html"
    model_of(3, ("lugre.vs",)).write(model)
    words = ["next-test", str(model), "--limits", "duration=1,rate=100", "--travel", "30:70", "--pressure", "1:300"]
    assert run([*words, "--sampling", "50", "--out", str(out), "--report", str(page)]) == 0
    assert "lugre.vs" in capsys.readouterr().out
    rows = out.read_text().splitlines()
    assert rows[0] == "time_s,pressure_kPa,expected_position_percent"
    assert len(rows) == 52
    assert "<html" in page.read_text()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--travel", "90:10"], "no part of the stroke"),
        (["--limits", "speed=3"], "no limit"),
        (["--duration", "-1"], "not a positive number"),
        (["--drive", "steam"], "no such drive"),
        (["--pressure", "1:2"], "the stem would hardly move"),
        (["--sampling", "1"], "too slow"),
    ],
)
def test_bad_limits_are_refused(tmp_path, capsys, options, said):
    model_of(3).write(tmp_path / "model.json")
    assert run(["next-test", str(tmp_path / "model.json"), *options]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1


def test_a_model_without_spring_or_stroke_is_refused():
    with pytest.raises(BadInput, match="no spring"):
        next_test({"valve": model_of(3, spring__K=0.0)}, BOUNDS)
    with pytest.raises(BadInput, match="stroke is not known"):
        next_test({"valve": model_of(3).model_copy(update={"plant": {}})}, BOUNDS)


@pytest.mark.slow
def test_pressure_is_not_asked_of_a_model_without_an_area():
    with pytest.raises(BadParameter, match="area"):
        next_test({"valve": model_of(3).model_copy(update={"plant": {"stroke_m": 0.02}})}, BOUNDS, drive="pressure")


def trace_of(verdict: str, same_class: list[str]) -> dict:
    base = model_of(4)
    values = base.values
    rows = [
        {"effect": "backlash", "refit": values | {"backlash.width": 2e-4}},
        {"effect": "hardening_spring", "refit": values | {"hardening_spring.k3": 1e7, "spring.K": 2e4}},
    ]
    known = {
        n: {"value": p.value, "std": p.std, "unit": p.unit, "status": p.status} for n, p in base.parameters.items()
    }
    about = {"effects": list(BASE), "parameters": known, "plant": base.plant, "noise": base.noise}
    return {
        "format": "valve-trace", "verdict": verdict, "same_class": same_class, "base": about, "candidates": rows,
    }  # fmt: skip


def test_the_models_of_a_trace():
    found = models_of_trace(trace_of("backlash", ["hardening_spring"]))
    assert list(found) == ["backlash", "hardening_spring"]
    assert found["hardening_spring"].values["spring.K"] == 2e4
    assert found["backlash"].parameters["backlash.width"].status == "weak"
    assert list(models_of_trace(trace_of("none", []))) == ["base"]


def test_a_file_that_is_no_trace_is_refused(tmp_path):
    (tmp_path / "old.json").write_text(json.dumps({"format": "valve-trace", "verdict": "backlash"}))
    with pytest.raises(BadInput, match="it is no trace that has its models"):
        models_of(tmp_path / "old.json")
    with pytest.raises(BadInput, match="no such file"):
        models_of(tmp_path / "none.json")
    (tmp_path / "deep.json").write_text("[" * 100_000)
    with pytest.raises(BadInput, match="nested"):
        models_of(tmp_path / "deep.json")


def test_limits_of_a_text():
    found = bounds_of("rate=20,pressure=40:180", duration=30.0)
    assert (found.rate, found.pressure, found.duration, found.travel) == (20.0, (40.0, 180.0), 30.0, (10.0, 90.0))
