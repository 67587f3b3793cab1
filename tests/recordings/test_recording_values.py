"""Signals and recordings as values: what they hold, what they refuse, and that nobody can change them."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError
from datetime import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recording_samples import FORCE, N_SAMPLES, POSITION, TIME, assert_same, recording

from recordings import UNITS, BadInput, Event, Plant, Recording, Signal, SignalSpec, convert, unit


@pytest.mark.parametrize(
    ("value", "source", "target", "expected"),
    [
        (1.0, "psi", "Pa", 6894.757293168361),
        (1.0, "lbf", "N", 4.4482216152605),
        (1.0, "in", "mm", 25.4),
        (212.0, "degF", "degC", 100.0),
        (-40.0, "degC", "degF", -40.0),
        (1.0, "bar", "kPa", 100.0),
        (1.0, "kgf/cm2", "bar", 0.980665),
        (36.0, "m3/h", "l/s", 10.0),
        (1.0, "gpm", "l/min", 3.785411784),
        (250.0, "ms", "s", 0.25),
        (50.0, "%", "1", 0.5),
        (1.0, "barg", "bar", 1.0),
        (1.0, "°F", "degF", 1.0),
    ],
)
def test_units_that_plants_use_convert_to_their_defined_value(
    value: float, source: str, target: str, expected: float
) -> None:
    assert convert(value, source, target) == pytest.approx(expected, rel=1e-12)


@given(st.sampled_from(sorted(UNITS)), st.floats(-1e6, 1e6))
def test_every_unit_comes_back_from_si(symbol: str, value: float) -> None:
    one = unit(symbol)
    assert one.from_si(one.to_si(value)) == pytest.approx(value, rel=1e-9, abs=1e-9)


def test_units_of_different_things_do_not_convert() -> None:
    with pytest.raises(BadInput, match=r"'bar' cannot be converted to 'N'; allowed units: N, kN"):
        convert(1.0, "bar", "N")
    with pytest.raises(BadInput, match=r"the unit 'furlong' is not known; known units: 1, %, s"):
        unit("furlong")


def test_si_converts_values_resolution_and_noise() -> None:
    stem = Signal("position", np.array([1.0, np.nan]), "mm", "output", resolution=0.1, noise_std=0.02).si()
    assert (stem.unit, stem.resolution, stem.noise_std) == ("m", pytest.approx(1e-4), pytest.approx(2e-5))
    np.testing.assert_allclose(stem.values, [1e-3, np.nan])
    warm = Signal("temperature", np.array([0.0]), "degC", "extra", resolution=0.5).si()
    assert (warm.unit, warm.values[0], warm.resolution) == ("K", 273.15, 0.5)


def test_position_in_percent_needs_the_stroke() -> None:
    clock, stem = Signal("time", TIME, "s", "time"), Signal("position", 50 + 0 * TIME, "%", "output", resolution=1.0)
    known = Recording.of([clock, stem], plant=Plant(stroke_m=0.04))
    assert known.si("position").unit == "m"
    assert known.si("position").values[0] == pytest.approx(0.02)
    assert known.si("position").resolution == pytest.approx(0.0004)
    unknown = Recording.of([clock, stem], title="old valve")
    with pytest.raises(BadInput, match=r"old valve: signal 'position': it is in '%' of a stroke .* stroke_m"):
        unknown.si("position")


def test_a_setpoint_in_percent_becomes_a_share() -> None:
    assert Signal("setpoint", np.array([25.0]), "%", "input").si().values[0] == 0.25


def test_nobody_can_change_a_recording() -> None:
    values = POSITION.copy()
    made = Recording.of([Signal("time", TIME, "s", "time"), Signal("position", values, "m", "output")])
    values[:] = 0.0
    assert made["position"].values[5] == POSITION[5]
    with pytest.raises(ValueError, match="read-only"):
        made["position"].values[0] = 1.0
    with pytest.raises(FrozenInstanceError):
        made.title = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        made.signals["position"] = made["time"]  # type: ignore[index]


def test_a_recording_is_a_mapping_of_its_signals_and_as_long_as_its_samples() -> None:
    made = recording()
    assert list(made) == ["time", "position", "force"]
    assert "force" in made
    assert "flow" not in made
    assert len(made) == N_SAMPLES
    np.testing.assert_array_equal(made.time, TIME)
    assert made.sha256 is None
    assert "40 samples of time [s], position [mm], force [N]" in repr(made)
    with pytest.raises(BadInput, match="steps: it has no signal 'flow'; signals there: time, position, force"):
        made["flow"]


def test_recordings_and_errors_travel_between_processes() -> None:
    made = recording()
    assert_same(pickle.loads(pickle.dumps(made)), made)
    error = pickle.loads(pickle.dumps(BadInput("a.h5", "it is empty", "copy it")))
    assert (str(error), error.where) == ("a.h5: it is empty; copy it", "a.h5")


CLOCK = Signal("time", TIME, "s", "time")


@pytest.mark.parametrize(
    ("signals", "words"),
    [
        ([Signal("position", POSITION, "m", "output")], "no signal named 'time'"),
        ([CLOCK, Signal("clock", TIME, "s", "time")], "2 signals have the role 'time': time, clock"),
        ([Signal("time", TIME, "s", "extra")], "no signal has the role 'time'"),
        ([CLOCK, Signal("position", POSITION[1:], "m", "output")], "position: it has 39 samples, time has 40"),
        ([Signal("time", TIME[:1], "s", "time")], "there are 1 samples; a recording holds at least 2"),
        ([Signal("time", TIME[::-1], "s", "time")], "time goes backwards at sample 1: 0.38 after 0.39"),
        ([Signal("time", np.array([0, 1, 1.0]), "s", "time")], "time repeats at sample 2: 1 after 1"),
        ([Signal("time", np.array([0, np.nan]), "s", "time")], "time is nan at sample 1"),
        ([Signal("time", np.array([-np.inf, 0]), "s", "time")], "time is -inf at sample 0"),
        ([CLOCK, Signal("force", np.nan * FORCE, "N", "input")], "force: every sample is missing"),
    ],
)
def test_parts_that_do_not_make_a_recording_are_refused(signals: list[Signal], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        Recording.of(signals)


def test_an_extra_signal_may_be_empty_throughout() -> None:
    assert "flow" in Recording.of([CLOCK, Signal("flow", np.nan * TIME, "m3/h", "extra")])


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"name": "a/b"}, "'a/b' cannot be the name of a signal"),
        ({"name": "position\0"}, "NUL"),
        ({"unit": " "}, "the unit is empty"),
        ({"unit": "bar"}, "'bar' is not a unit of position; allowed for position: m, cm, mm"),
        ({"unit": "furlong"}, "the unit 'furlong' is not known"),
        ({"name": "time", "unit": "ms", "role": "time"}, "the unit of time is 'ms'; time is in 's'"),
        ({"role": "driver"}, "the role is 'driver'; allowed: time, input, output, extra"),
        ({"resolution": -1.0}, "resolution is -1.0; resolution is a finite number of 0 or more"),
        ({"noise_std": np.inf}, "noise_std is inf"),
        ({"description": "\ud800"}, "lone surrogate"),
    ],
)
def test_signals_refuse_what_the_format_cannot_hold(fields: dict[str, object], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        SignalSpec(**({"name": "position", "unit": "m", "role": "output"} | fields))  # type: ignore[arg-type]


def test_values_have_one_dimension() -> None:
    with pytest.raises(BadInput, match="the values have 2 dimensions"):
        Signal("position", np.zeros((2, 2)), "m", "output")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("moving_mass_kg", 0.0, "finite and positive"),
        ("stroke_m", np.nan, "finite and positive"),
        ("diaphragm_area_m2", -1.0, "finite and positive"),
        ("spring_constant_N_per_m", -1.0, "finite and not negative"),
        ("spring_preload_N", np.inf, "is finite"),
        ("stroke_m", "long", "is not a number"),
        ("tag", 5, "int is not text"),
    ],
)
def test_a_plant_refuses_what_cannot_be(name: str, value: object, words: str) -> None:
    with pytest.raises(BadInput, match=f"/plant: {name}: .*{words}"):
        Plant(**{name: value})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("about", "words"),
    [
        ({"source": "lab"}, "it is 'lab'; allowed: plant, rig, simulated"),
        ({"created": datetime(2026, 11, 21)}, "not a date with a time zone"),
        ({"attributes": {"version": 2}}, "'version' cannot be the name of a further attribute"),
        ({"attributes": {"big": 2**70}}, "does not fit 64 bits"),
        ({"attributes": {"list": [1, 2]}}, "list is not text"),
        ({"title": "a\0b"}, "NUL"),
    ],
)
def test_a_recording_refuses_what_the_format_cannot_hold(about: dict[str, object], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        Recording.of([CLOCK], **about)


@pytest.mark.parametrize("fields", [(np.nan, "note", "x"), (1.0, 2, "x"), (1.0, "note", "a\0")])
def test_events_need_a_time_a_kind_and_a_text(fields: tuple[object, ...]) -> None:
    with pytest.raises(BadInput, match="an event has a finite time in s, a kind and a text"):
        Event(*fields)  # type: ignore[arg-type]
