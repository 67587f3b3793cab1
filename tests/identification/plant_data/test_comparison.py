"""What changed between two recordings or two models of one valve: the change, and nothing else."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import bristle as br
from bristle.cli.app import run
from identification.comparison.strokes import strokes
from recordings import BadInput, BadParameter, NegativeAnswer, Recording, write
from simulator import BASE, Excitation, Sensors, ValveModel, random_valve, simulate

SPOT = {"position_dependent_friction.a": 0.4, "position_dependent_friction.w": 0.001,
        "position_dependent_friction.b": 0.0}  # fmt: skip
VALVE, STROKE = random_valve(3)


def recorded(change: Mapping[str, float], seed: int, course: str = "staircase:20,sine:30") -> Recording:
    """A recording of the valve with some values changed, in other positions for another seed."""
    sensors = Sensors(100.0, position_noise=2e-4 * STROKE, force_noise=1e-3 * VALVE["spring.K"] * STROKE)
    effects = (*BASE, "position_dependent_friction") if "position_dependent_friction.a" in change else BASE
    excitation = Excitation.parse(course)
    return simulate({**VALVE, **change}, excitation, sensors, stroke=STROKE, effects=effects, seed=seed)[0]


@cache
def before() -> Recording:
    """The valve as it was."""
    return recorded({}, 1)


def test_the_same_valve_has_not_changed():
    for seed in (2, 3, 4):
        found = br.compare(before(), recorded({}, seed))
        assert found.changed == ()
        assert found.places == ()
        assert found.sentences()[0] == "Nothing changed beyond noise and repeatability."


def test_more_friction_is_found_and_sized():
    more = {name: 1.2 * VALVE[name] for name in ("lugre.fc", "lugre.fs")}
    found = br.compare(before(), recorded(more, 2))
    assert found.changed[0] == "friction"
    friction = found.quantities[0]
    assert friction.lower < friction.difference < friction.upper
    assert friction.difference / friction.before.value == pytest.approx(0.2, abs=0.06)


def test_a_stiffer_spring_is_found_and_sized():
    found = br.compare(before(), recorded({"spring.K": 1.1 * VALVE["spring.K"]}, 2))
    rate = next(q for q in found.quantities if q.name == "spring rate")
    assert rate.changed
    assert rate.before.value == pytest.approx(VALVE["spring.K"], rel=0.1)
    assert rate.difference / rate.before.value == pytest.approx(0.1, abs=0.03)


def test_a_tight_spot_is_found_where_it_is():
    place = 0.4 * STROKE
    found = br.compare(before(), recorded({**SPOT, "position_dependent_friction.x0": place}, 2))
    assert found.places
    low, high, friction, tighter = max(found.places, key=lambda p: p[3] - p[2])
    assert low - 0.002 < place < high + 0.002
    assert tighter > 1.05 * friction


def test_what_tests_of_an_unchanged_valve_differ_by_is_no_change():
    slightly = {name: 1.06 * VALVE[name] for name in ("lugre.fc", "lugre.fs")}
    after = recorded(slightly, 2)
    assert "friction" in br.compare(before(), after).changed
    assert br.compare(before(), after, repeatability=0.1).changed == ()


def test_tests_that_are_not_alike_are_said_to_be_so():
    found = br.compare(before(), recorded({"spring.K": 1.3 * VALVE["spring.K"]}, 2, "sine:20"))
    assert not found.alike
    assert "not alike" in found.notes[0]
    assert found.sentences()[0].startswith("Changed, or tested differently")
    assert br.compare(before(), recorded({}, 2)).alike


def test_too_few_strokes_are_no_answer():
    with pytest.raises(NegativeAnswer, match="strokes up"):
        br.compare(before(), recorded({}, 2, "step:6"))


def test_strokes_of_a_course_are_its_runs_in_one_direction():
    x = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 5), (5, 4.99), (4.99, 9), (9, 1), (1, 2))])
    assert [(s.direction, round(x[s.last - 1] - x[s.first], 2)) for s in strokes(x)] == [(1, 9), (-1, -8), (1, 1)]
    assert strokes(np.zeros(100)) == []


def model(**values: float) -> ValveModel:
    """A model with standard deviations of 1 %."""
    names = {"fc": "lugre.fc", "K": "spring.K"}
    rows = {names[n]: {"value": v, "std": 0.01 * v, "unit": "N", "status": "identified"} for n, v in values.items()}
    return ValveModel.model_validate({"effects": ["spring"], "parameters": rows})


def test_models_are_compared_by_their_standard_deviations():
    found = br.compare(model(fc=100.0, K=5e4), model(fc=110.0, K=5.05e4))
    assert found.changed == ("lugre.fc",)
    assert br.compare(model(fc=100.0, K=5e4), model(fc=110.0, K=5e4), repeatability=0.05).changed == ()
    assert "does not tell" in " ".join(br.compare(unknown(), model(fc=1.0)).notes)


def unknown() -> ValveModel:
    """A model that does not tell its friction."""
    row = {"value": 1.0, "std": None, "unit": "N", "status": "unresolved"}
    return ValveModel.model_validate({"effects": ["spring"], "parameters": {"lugre.fc": row}})


def test_the_command_writes_its_answer_and_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    write(tmp_path / "before.h5", before())
    write(tmp_path / "after.h5", recorded({name: 1.2 * VALVE[name] for name in ("lugre.fc", "lugre.fs")}, 2))
    out, page = tmp_path / "compare.json", tmp_path / "compare.html"
    words = ["compare", str(tmp_path / "before.h5"), str(tmp_path / "after.h5"), "--out", str(out)]
    assert run([*words, "--report", str(page)]) == 0
    assert "Changed: friction" in capsys.readouterr().out
    content = json.loads(out.read_text())
    assert (content["format"], content["version"], content["kind"]) == ("valve-comparison", 1, "recordings")
    assert "friction" in content["changed"]
    text = page.read_text()
    assert "Friction along the travel" in text
    assert "<script src" not in text


def test_bad_input_is_refused_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    br.fit("bundled:step", crosscheck=False).write(tmp_path / "model.json")
    assert run(["compare", "bundled:step", str(tmp_path / "model.json")]) == 2
    assert "one is a model and one a recording" in capsys.readouterr().err
    assert run(["compare", "bundled:step", str(tmp_path / "nowhere.h5")]) == 2
    with pytest.raises(BadParameter, match="repeatability"):
        br.compare("bundled:step", "bundled:mixed", repeatability=3.0)
    with pytest.raises(BadInput):
        br.compare(tmp_path / "nowhere.json", "bundled:step")
