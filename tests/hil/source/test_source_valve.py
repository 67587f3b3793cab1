"""A valve as a source sees it: what its recording declares, and which names and devices it may have."""

from __future__ import annotations

import pytest
from link_rig import MAP

from hil import Polling, RegisterMap, Valve, open_source, valves_of
from recordings import BadInput


def test_a_recording_of_a_valve_declares_roles_units_and_resolution():
    points = [
        {"name": "position", "table": "input", "address": 0, "type": "int16", "scale": 0.01, "unit": "mm"},
        {
            "name": "pressure",
            "table": "input",
            "address": 1,
            "type": "float32",
            "unit": "kPa",
            "description": "chamber",
        },
        {"name": "mode", "table": "input", "address": 3, "type": "uint16"},
    ]
    valve = Valve("V1", RegisterMap.model_validate({"name": "m", "points": points}))
    specs = {spec.name: spec for spec in valve.signals()}
    assert [spec.role for spec in specs.values()] == ["time", "output", "input", "extra"]
    assert (specs["position"].resolution, specs["position"].unit) == (0.01, "mm")
    assert (specs["pressure"].description, specs["pressure"].resolution) == ("chamber", None)


def test_a_point_named_like_the_clock_of_a_recording_is_refused():
    point = {"name": "time", "unit": "s", "table": "input", "address": 0, "type": "int16"}
    valve = Valve("V1", RegisterMap.model_validate({"name": "m", "points": [point]}))
    with pytest.raises(BadInput, match="rename the point"):
        valve.signals()


def test_equal_valves_on_one_line_have_their_own_names_and_units():
    valves = valves_of(MAP, units=(4, 7), names=("LC51", "LC74"))
    assert [(valve.name, valve.units) for valve in valves] == [("LC51", (4,)), ("LC74", (7,))]
    for units, names in (((1, 1), ()), ((1, 2), ("A",)), ((1, 2), ("A", "A")), ((1,), ("a/b",))):
        with pytest.raises(BadInput):
            valves_of(MAP, units, names)


def test_a_live_source_without_a_map_or_with_an_unknown_heartbeat_is_bad_input():
    with pytest.raises(BadInput, match="register map"):
        open_source("tcp://127.0.0.1:5020")
    with pytest.raises(BadInput, match="there is no point 'pulse'"):
        open_source("tcp://127.0.0.1:5020", valves_of(MAP), Polling(1.0, heartbeat="pulse"))
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(BadInput, match="rate"):
            Polling(rate)
