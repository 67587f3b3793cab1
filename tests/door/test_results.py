"""What the door's functions give back: a few lines at the prompt, a table in a notebook, files, and pictures."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import bristle as br
from identification import identify

LONGEST = 1000
"""Characters that a result may take at the prompt."""


@pytest.fixture(scope="module")
def recording():
    return br.simulate("mixed:10", position_noise=2e-6, seed=3)


@pytest.fixture(scope="module")
def fitted(recording):
    return br.fit(recording, crosscheck=False)


@pytest.fixture(scope="module")
def traced():
    return br.trace(br.simulate("mixed:20", position_noise=3e-6, force_noise=0.1, seed=3))


@pytest.fixture(params=["fitted", "traced"])
def result(request):
    return request.getfixturevalue(request.param)


def test_it_says_what_it_is_in_a_few_lines(result):
    text = repr(result)
    assert len(text) < LONGEST
    assert 2 <= len(text.splitlines()) <= 4
    assert "recording" in text  # what was fitted


def test_a_fit_says_its_values_and_a_trace_its_verdict(fitted, traced):
    assert "converged" in repr(fitted)
    assert f"spring.K {fitted.values['spring.K']:.4g}" in repr(fitted)
    assert "free-run error: fit" in repr(fitted)
    assert f"Trace of recording: {traced.verdict}" in repr(traced)
    assert "before" in repr(traced)
    assert "after" in repr(traced)


def test_a_notebook_gets_a_small_table_without_scripts(result):
    page = result._repr_html_()
    assert page.startswith("<table>")
    assert page.endswith("</table>")
    assert page.count("<tr>") >= 5
    assert "<script" not in page
    assert len(page) < 5000


def test_a_notebook_takes_no_orders_from_a_recording(fitted):
    named = replace(fitted, trajectories=(replace(fitted.trajectories[0], name="<script>alert(1)</script>"),))
    assert "<script" not in named._repr_html_()


def test_values_are_those_of_the_model_that_is_written(result, tmp_path):
    result.model.write(tmp_path / "model.json")
    assert br.ValveModel.read(tmp_path / "model.json").values == result.values


def test_what_is_written_is_what_the_command_writes(fitted, traced, tmp_path):
    fitted.write(tmp_path / "model.json")
    traced.write(tmp_path / "trace.json")
    assert json.loads((tmp_path / "model.json").read_text())["format"] == "valve-model"
    assert json.loads((tmp_path / "trace.json").read_text())["format"] == "valve-trace"


def test_a_report_is_one_page(result, tmp_path):
    result.report(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html>")


def test_pictures_are_a_layout_of_bokeh(result):
    from bokeh.embed import file_html

    shown = result.plot()
    assert len(shown.children) >= 2
    assert file_html(shown).lstrip().startswith("<!DOCTYPE html>")


def test_a_report_that_cannot_be_written_is_refused(result, tmp_path):
    with pytest.raises(br.BadInput, match="nowhere"):
        result.report(tmp_path / "nowhere" / "page.html")


def test_a_fit_is_that_of_the_library(recording, fitted):
    assert identify([recording], check=False).model == fitted.model


@pytest.mark.slow
def test_one_recording_or_several_by_value_or_by_name(tmp_path):
    step = br.read("bundled:step")
    br.write(tmp_path / "step.h5", step)
    assert br.read(tmp_path / "step.h5").sha256
    asked = [step, "bundled:step", str(tmp_path / "step.h5"), [tmp_path / "step.h5"]]
    values = [br.fit(one, crosscheck=False).values for one in asked]
    assert all(one == values[0] for one in values)


def test_what_is_known_is_held(recording):
    found = br.fit(recording, given={"mass.m": 3.0}, without=["spring"], crosscheck=False)
    assert found.values["mass.m"] == 3.0
    assert found.values["spring.K"] == 0.0
    assert found.model.parameters["mass.m"].status == "given"


def test_an_area_turns_pressure_into_force():
    step = br.read("bundled:step")
    pressure = replace(step["force"], name="pressure", values=step["force"].values / 0.029 / 1e3, unit="kPa")
    recording = br.Recording.of([step["time"], pressure, step["position"]])
    with pytest.raises(br.BadInput, match="area"):
        br.fit(recording)
    expected = br.fit(step, crosscheck=False).values["spring.K"]
    assert br.fit(recording, area=0.029, crosscheck=False).values["spring.K"] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("asked", "parameter"),
    [
        ({"causality": "sideways"}, "causality"),
        ({"estimator": "best"}, "estimator"),
        ({"without": ["lugre"]}, "without"),
        ({"given": {"mass.q": 1.0}}, "given"),
    ],
)
def test_a_wrong_parameter_is_named(recording, asked, parameter):
    with pytest.raises(br.BadInput) as said:
        br.fit(recording, **asked)
    assert said.value.parameter == parameter
    assert "--" not in str(said.value)


@pytest.mark.parametrize(
    ("asked", "parameter"), [({"rate": 0.0}, "rate"), ({"stroke": -1.0}, "stroke"), ({"given": {"a.b": 1.0}}, "given")]
)
def test_a_wrong_parameter_of_a_simulation_is_named(asked, parameter):
    with pytest.raises(br.BadParameter) as said:
        br.simulate("sine:1", **asked)
    assert said.value.parameter == parameter


def test_a_seed_repeats_a_simulation():
    first, again, other = (br.simulate("sine:1", seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(first["position"].values, again["position"].values)
    assert not np.array_equal(first["position"].values, other["position"].values)


def test_a_model_is_simulated(fitted, tmp_path):
    fitted.write(tmp_path / "model.json")
    by_value, by_path = (br.simulate("sine:1", model=model) for model in (fitted.model, tmp_path / "model.json"))
    assert np.array_equal(by_value["position"].values, by_path["position"].values)


def test_an_effect_is_simulated_in_its_typical_size_or_in_another():
    plain = br.simulate("sine:2", seed=1)
    typical = br.simulate("sine:2", seed=1, effects=["backlash"])
    none = br.simulate("sine:2", seed=1, effects=["backlash"], given={"backlash.width": 0.0})
    assert not np.array_equal(typical["position"].values, plain["position"].values)
    assert np.allclose(none["position"].values, plain["position"].values, atol=1e-9)


def test_errors_are_caught_at_any_level():
    assert issubclass(br.BadParameter, br.BadInput)
    assert issubclass(br.ProtocolError, br.LinkError)
    assert all(issubclass(one, br.BristleError) for one in (br.BadInput, br.NegativeAnswer, br.LinkError))
