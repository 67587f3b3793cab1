"""The short forms of `bristle import` and `bristle record`: columns, the time, the plant."""

from __future__ import annotations

import pytest

from bristle.cli.import_options import clock_of, plant_from, plant_of, signals_of
from recordings import BadInput, Plant


@pytest.mark.parametrize(
    ("option", "expected"),
    [
        ("position=5:mm", {"column": "5", "unit": "mm"}),
        ("position=AI:1:mm:output", {"column": "AI:1", "unit": "mm", "role": "output"}),
        ("position = Stem pos : mm", {"column": "Stem pos", "unit": "mm"}),
        ("position=x", {"column": "x"}),
    ],
)
def test_columns_in_short_form(option: str, expected: dict[str, str]) -> None:
    assert signals_of([option]) == {"position": expected}


@pytest.mark.parametrize("option", ["position", "=5:mm", "position=", "position=:mm"])
def test_short_forms_that_name_no_column_are_refused(option: str) -> None:
    with pytest.raises(BadInput, match=r"--column: .* names no column; write --column NAME=COLUMN:UNIT"):
        signals_of([option])


def test_other_short_forms_that_are_refused() -> None:
    with pytest.raises(BadInput, match="--column: time has an option of its own; write --time 1:ms"):
        signals_of(["time=1:ms"])
    with pytest.raises(BadInput, match="--plant: 'stroke_m' names no value; write --plant NAME=VALUE"):
        plant_of(["stroke_m"])
    with pytest.raises(BadInput, match="--plant: 'long' is not a number; write --plant stroke_m=NUMBER"):
        plant_of(["stroke_m=long"])
    with pytest.raises(
        BadInput, match=r"'stroke' is not known of a plant; did you mean 'stroke_m'. write one of moving_mass_kg,"
    ):
        plant_of(["stroke=1"])


def test_time_and_several_signals_in_short_form() -> None:
    assert clock_of(None) == {}
    assert clock_of("t:ms") == {"column": "t", "unit": "ms"}
    assert clock_of("t") == {"column": "t"}
    assert signals_of(["position=3:mm:input", "level=#2*2:%"]) == {
        "position": {"column": "3", "unit": "mm", "role": "input"},
        "level": {"column": "#2*2", "unit": "%"},
    }


def test_a_plant_in_short_form() -> None:
    assert plant_of(["diaphragm_area_m2=0.029", " tag=V-1"]) == {"diaphragm_area_m2": 0.029, "tag": "V-1"}
    assert plant_from(["stroke_m=0.02"]) == Plant(stroke_m=0.02)
    assert plant_from([]) == Plant()
    with pytest.raises(BadInput, match="/plant: stroke_m"):
        plant_from(["stroke_m=-1"])
