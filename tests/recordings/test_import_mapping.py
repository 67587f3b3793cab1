"""Mappings: the ready ones, those of users, and what they must not say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from recordings import UNDERSTOOD, BadInput, find_unit
from recordings.importers import (
    ImportMapping,
    load_mapping,
    mapping_names,
    mapping_of,
    with_changes,
)

READY = ("emps", "pneumatic-cylinder", "pneumatic-cylinder-257", "tribometer", "damadics-plant-hour")


def test_the_ready_mappings_are_there() -> None:
    assert {*READY, "kinova-joint7", "valve-signature"} <= set(mapping_names())


@pytest.mark.parametrize("name", mapping_names())
def test_every_ready_mapping_gives_a_position_and_says_where_it_is_from(name: str) -> None:
    mapping = load_mapping(name)
    assert mapping.title
    assert mapping.source in {"plant", "rig"}
    assert not mapping.carry
    assert "position" in mapping.signals
    for signal, source in mapping.signals.items():
        assert source.unit
        assert find_unit(source.unit)
        assert source.description or signal not in UNDERSTOOD


def test_a_mapping_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text('title = "Rig 4"\n[time]\ncolumn = "t"\nunit = "ms"\n[signals.position]\ncolumn = 2\nunit = "mm"\n')
    mapping = load_mapping(path)
    assert (mapping.title, mapping.time.unit, mapping.signals["position"].column) == ("Rig 4", "ms", 2)


REFUSED: dict[str, tuple[str, str]] = {
    "unknown key": (
        "titel = 'x'",
        "rig.toml: titel: this key is not known; known there: title, source, carry, file, time",
    ),
    "unknown key below": (
        "[file]\nsep = ','",
        "rig.toml: file.sep: this key is not known; known there: separator, decimal",
    ),
    "unknown key of a signal": (
        "[signals.position]\ncolumn = 1\nunti = 'mm'",
        "rig.toml: signals.position.unti: this key is not known; known there: column, formula, unit",
    ),
    "unknown key of reverse": (
        "[file.reverse]\ncolumn = 1\nvalue = 'x'\nway = 1",
        "rig.toml: file.reverse.way: this key is not known; known there: column, value",
    ),
    "no source of a signal": (
        "[signals.position]\nunit = 'mm'",
        "signals.position: a signal comes from a column or from a",
    ),
    "two sources": (
        "[signals.force]\ncolumn = 1\nformula = '2*x'",
        "signals.force: a signal comes from a column or from a",
    ),
    "formula without unit": (
        "[signals.force]\nformula = '2*x'",
        "signals.force: a formula needs the unit of its result",
    ),
    "unknown role": (
        "[signals.force]\ncolumn = 1\nrole = 'cause'",
        "signals.force.role: Input should be 'time', 'input'",
    ),
    "two clocks": ("[time]\ncolumn = 1\nrate_hz = 5.0", "rig.toml: time: time comes from a column or from a rate"),
    "rate of zero": ("[time]\nrate_hz = 0.0", "rig.toml: time.rate_hz: Input should be greater than 0 (found 0.0)"),
    "unit of time": (
        "[time]\nunit = 'mm'",
        "rig.toml: time.unit: 'mm' is not a unit of time; allowed: s, ms, us, ns, min",
    ),
    "time as a signal": ("[signals.time]\ncolumn = 1", "rig.toml: signals: time is described in the section [time]"),
    "unknown plant": (
        "[plant]\nstroke = 3",
        "rig.toml: plant: 'stroke' is not known of a plant; allowed: moving_mass_kg",
    ),
    "separator": ("[file]\nseparator = 'dot'", "rig.toml: file.separator: 'dot' is no separator; allowed: auto, comma"),
    "decimal twice": ("[file]\nseparator = ','\ndecimal = ','", "file: the decimal sign ',' is also the separator"),
    "no TOML": ("[time", "rig.toml: it is not TOML ("),
    "wrong source": ("source = 'lab'", "rig.toml: source: Input should be 'plant', 'rig' or 'simulated' (found 'lab')"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_mapping_must_not_say_is_named(tmp_path: Path, name: str) -> None:
    text, words = REFUSED[name]
    path = tmp_path / "rig.toml"
    path.write_text(text)
    with pytest.raises(BadInput) as caught:
        load_mapping(path)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_mapping_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="nowhere: there is no such mapping; give a TOML file or one of: damadics"):
        load_mapping("nowhere")
    (tmp_path / "rig.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadInput, match="it is not text in UTF-8; see docs"):
        load_mapping(tmp_path / "rig.toml")
    with pytest.raises(BadInput, match="it is a directory"):
        load_mapping(tmp_path)


def test_options_change_a_mapping_section_by_section() -> None:
    base = load_mapping("valve-signature")
    changes: dict[str, Any] = {
        "title": None,
        "source": "rig",
        "time": {"rate_hz": 5.0, "from_s": None},
        "plant": {"diaphragm_area_m2": 0.029, "tag": "V-1"},
        "signals": {
            "position": {"column": "3", "unit": "mm", "role": "input"},
            "level": {"column": "#2*2", "unit": "%"},
        },
    }
    changed = with_changes(base, changes, "options")
    assert (changed.title, changed.source, changed.time.rate_hz) == (base.title, "rig", 5.0)
    assert changed.plant == {"stroke_m": 0.0381, "diaphragm_area_m2": 0.029, "tag": "V-1"}
    position = changed.signals["position"]
    assert (position.column, position.unit, position.role, position.description) == ("3", "mm", "input", None)
    assert changed.signals["pressure"] == base.signals["pressure"]
    assert changed.file == base.file


def test_a_column_of_time_replaces_a_rate_and_the_other_way_round() -> None:
    by_rate = mapping_of({"time": {"rate_hz": 10.0, "from_s": 1.0}}, "x")
    by_column = with_changes(by_rate, {"time": {"column": "t", "unit": "ms"}}, "options")
    assert (by_column.time.column, by_column.time.unit, by_column.time.rate_hz, by_column.time.from_s) == (
        "t",
        "ms",
        None,
        1,
    )
    back = with_changes(by_column, {"time": {"rate_hz": 3.0}}, "options")
    assert (back.time.column, back.time.unit, back.time.rate_hz) == (None, None, 3.0)
    with pytest.raises(BadInput, match="options: time: time comes from a column or from a rate"):
        with_changes(ImportMapping(), {"time": {"column": "t", "unit": "ms"} | {"rate_hz": 3.0}}, "options")
