"""A valve model as a file: what is written is read, and a damaged file is refused by name and item."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recordings import BadInput
from simulator import CATALOGUE, FittedTo, Value, ValveModel, random_valve

UNITS = {name: p.unit for e in CATALOGUE.effects for name, p in zip(e.parameter_names(), e.parameters, strict=True)}


def model(seed: int = 1) -> ValveModel:
    values, stroke = random_valve(seed)
    parameters = {
        name: Value(value=value, std=0.01 * value, unit=UNITS[name], lower=0.0, status="identified")
        for name, value in values.items()
    }
    return ValveModel(
        effects=("inertia", "spring", "lugre"), parameters=parameters, plant={"stroke_m": stroke, "tag": "LC74"},
        noise={"position_m": 3e-6, "force_N": None}, fitted_to=(FittedTo(file="a.h5", sha256="00", samples=10),),
        error={"fit": {"rmse_m": 1e-6, "nrmse": 1e-4}, "holdout": None}, quality={"outcome": "converged", "advice": []},
    )  # fmt: skip


@pytest.fixture
def content() -> dict:
    return json.loads(model().model_dump_json())


def refused(tmp_path, text: str | bytes) -> str:
    """The message with which a file is refused, without the folder."""
    path = tmp_path / "bad.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(BadInput) as problem:
        ValveModel.read(path)
    said = str(problem.value)
    assert "bad.json" in said
    assert "\n" not in said
    assert problem.value.remedy
    return said.replace(str(tmp_path), "")


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_what_is_written_is_what_is_read(tmp_path_factory, seed):
    path = tmp_path_factory.mktemp("model") / "model.json"
    model(seed).write(path)
    assert ValveModel.read(path) == model(seed)
    assert ValveModel.read(path).values == random_valve(seed)[0]


def test_the_file_is_plain_json_and_ends_with_a_line(tmp_path):
    model().write(tmp_path / "model.json")
    text = (tmp_path / "model.json").read_text()
    assert text.endswith("}\n")
    assert json.loads(text)["format"] == "valve-model"
    assert json.loads(text)["parameters"]["lugre.fc"]["unit"] == "N"


@pytest.mark.parametrize(
    ("item", "value", "words"), [("std", -1.0, "greater than or equal to 0"), ("upper", -5.0, "above the upper one")]
)
def test_numbers_that_contradict_one_another_are_refused(tmp_path, content, item, value, words):
    content["parameters"]["spring.K"][item] = value
    said = refused(tmp_path, json.dumps(content))
    assert "parameters.spring.K" in said
    assert words in said


def test_writing_is_all_or_nothing(tmp_path):
    model(1).write(tmp_path / "model.json")
    model(2).write(tmp_path / "model.json")
    assert ValveModel.read(tmp_path / "model.json") == model(2)
    assert [path.name for path in tmp_path.iterdir()] == ["model.json"]


@pytest.mark.parametrize(
    ("place", "words"),
    [("nowhere/model.json", r"nowhere/model\.json: the folder does not exist"), (".", "it is a directory")],
)
def test_a_place_that_cannot_be_written_is_named(tmp_path, place, words):
    with pytest.raises(BadInput, match=words):
        model().write(tmp_path / place)
    assert list(tmp_path.iterdir()) == []


def test_the_folder_that_one_is_in_is_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match="it is a directory"):
        model().write(".")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(BadInput, match=r"nowhere\.json"):
        ValveModel.read(tmp_path / "nowhere.json")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_a_cut_off_file_is_refused(tmp_path, content, share):
    whole = json.dumps(content)
    assert "JSON" in refused(tmp_path, whole[: int(share * len(whole))])


@pytest.mark.parametrize("text", [b"\xff\xfe\x00", b"[]", b"null", b"[" * 100000, b'"valve-model"'])
def test_what_is_no_model_is_refused(tmp_path, text):
    assert refused(tmp_path, text)


def without(name):
    return lambda c: c["parameters"].pop(name)


def changed(name, **items):
    return lambda c: c["parameters"][name].update(items)


DAMAGES = {
    "a higher version": (lambda c: c.update(version=2), "version"),
    "another format": (lambda c: c.update(format="valve-trace"), "format"),
    "no parameters": (lambda c: c.pop("parameters"), "parameters"),
    "a missing parameter": (without("lugre.vs"), "lugre.vs"),
    "an unknown effect": (lambda c: c["effects"].append("wobble"), "wobble"),
    "not a number": (changed("lugre.vs", value=float("nan")), "lugre.vs.value"),
    "infinity": (changed("lugre.vs", std=float("inf")), "lugre.vs.std"),
    "nothing": (changed("lugre.vs", value=None), "lugre.vs.value"),
    "words": (changed("lugre.vs", value="fast"), "lugre.vs.value"),
    "an unknown status": (changed("lugre.vs", status="great"), "lugre.vs.status"),
    "no unit": (lambda c: c["parameters"]["lugre.vs"].pop("unit"), "lugre.vs.unit"),
    "below its bound": (changed("mass.m", value=-2.0), "mass.m"),
    "a stroke in words": (lambda c: c["plant"].update(stroke_m="long"), "stroke_m"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_item_is_named(tmp_path, content, name):
    damage, item = DAMAGES[name]
    damage(content)
    assert item in refused(tmp_path, json.dumps(content))


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_no_damage_leads_to_anything_but_a_refusal(tmp_path_factory, data):
    text = bytearray(model().model_dump_json().encode())
    for _ in range(data.draw(st.integers(1, 4))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("model") / "model.json"
    path.write_bytes(bytes(text))
    try:
        said, found = "", set(ValveModel.read(path).values)
    except BadInput as problem:
        said, found = str(problem), set()
    assert said.startswith(str(path)) or set(random_valve(1)[0]) <= found
