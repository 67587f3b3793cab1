"""Arrays in, arrays out: recordings made without a file."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from recordings import BadInput, BadParameter, Plant, Recording, bundled, bundled_names, read, write

T = np.array([0.0, 0.1, 0.2, 0.3])
X = np.array([0.0, 1.0, np.nan, 3.0])
F = np.array([10, 20, 30, 40])


class Column:
    """A column as data frames have it."""

    def __init__(self, values: Any) -> None:
        self.values = np.asarray(values)

    def to_numpy(self) -> Any:
        return self.values


class DataFrame:
    """The least that a data frame is."""

    def __init__(self, columns: dict[Any, Any]) -> None:
        self._columns = {label: Column(values) for label, values in columns.items()}
        self.columns = list(columns)

    def __getitem__(self, label: Any) -> Column:
        return self._columns[label]


def test_arrays_make_a_recording_in_si_units() -> None:
    recording = Recording.from_arrays(time=T, position=X, force=F, title="rig", source="rig", plant={"stroke_m": 4.0})
    assert list(recording) == ["time", "force", "position"]
    np.testing.assert_array_equal(recording["position"].values, X)
    np.testing.assert_array_equal(recording["force"].values, F)
    assert [signal.unit for signal in recording.signals.values()] == ["s", "N", "m"]
    assert (recording.title, recording.source, recording.plant) == ("rig", "rig", Plant(stroke_m=4.0))


def test_a_file_of_it_is_the_same_recording(tmp_path: Any) -> None:
    recording = Recording.from_arrays(time=T, position=X, force=F)
    write(tmp_path / "rec.h5", recording)
    for name, values in read(tmp_path / "rec.h5").to_arrays().items():
        np.testing.assert_array_equal(values, recording[name].values)


def test_the_arrays_of_the_caller_stay_his() -> None:
    mine = X.copy()
    recording = Recording.from_arrays(time=T, position=mine)
    mine[0] = 99.0
    assert recording["position"].values[0] == 0.0
    assert mine.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        recording.to_arrays()["position"][0] = 1.0


def test_units_by_name_are_converted() -> None:
    units = {
        "time": "ms",
        "position": "mm",
        "pressure": "kPa",
        "flow": "l/s",
        "temperature": "K",
        "stem torque": "mN.m",
    }
    recording = Recording.from_arrays(
        time=1e3 * T, position=X, pressure=F, flow=F, temperature=F, extra={"stem torque": F}, units=units
    )
    np.testing.assert_allclose(recording.time, T)
    np.testing.assert_allclose(recording["position"].values, 1e-3 * X)
    np.testing.assert_allclose(recording["pressure"].values, 1e3 * F)
    np.testing.assert_allclose(recording["flow"].values, 3.6 * F)
    np.testing.assert_allclose(recording["temperature"].values, F - 273.15)
    stored = {name: signal.unit for name, signal in recording.signals.items()}
    assert stored == {
        "time": "s", "pressure": "Pa", "position": "m", "flow": "m3/h", "temperature": "degC", "stem torque": "mN.m",
    }  # fmt: skip


def test_a_position_in_percent_needs_the_stroke_for_metres() -> None:
    share = Recording.from_arrays(time=T, position=F, units={"position": "%"})
    assert share["position"].unit == "%"
    metres = Recording.from_arrays(time=T, position=F, units={"position": "%"}, plant=Plant(stroke_m=0.02))
    np.testing.assert_allclose(metres["position"].values, 0.02 * F / 100)
    assert metres["position"].unit == "m"


def test_roles_are_the_usual_ones_or_those_given() -> None:
    arrays: dict[str, Any] = {"setpoint": F, "drive": F, "pressure": F, "force": F, "position": X, "velocity": X}
    usual = Recording.from_arrays(time=T, **arrays)
    roles = {name: signal.role for name, signal in usual.signals.items()}
    assert roles.pop("time") == "time"
    assert [name for name, role in roles.items() if role == "input"] == ["setpoint", "drive", "pressure", "force"]
    assert (roles["position"], roles["velocity"]) == ("output", "extra")
    imposed = Recording.from_arrays(time=T, position=X, force=F, roles={"position": "input", "force": "output"})
    assert (imposed["position"].role, imposed["force"].role) == ("input", "output")


def test_dates_become_seconds_since_the_first() -> None:
    stamps = np.datetime64("2026-11-21T09:30:00") + np.array([0, 250, 500, 1000]) * np.timedelta64(1, "ms")
    np.testing.assert_allclose(Recording.from_arrays(time=stamps, position=X).time, [0, 0.25, 0.5, 1.0])


def test_infinite_values_are_missing() -> None:
    recording = Recording.from_arrays(time=T, position=[0.0, np.inf, 1.0, -np.inf])
    np.testing.assert_array_equal(recording["position"].values, [0.0, np.nan, 1.0, np.nan])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"force": F[:3]}, "/signals/force: it has 3 samples, time has 4; all signals have one length"),
        ({"time": [0.0, 0.1, np.nan, 0.3]}, "/signals/time: time is nan at sample 2"),
        ({"time": [0.0, 0.1, 0.1, 0.3]}, "time repeats at sample 2: 0.1 after 0.1; time is finite and strictly"),
        ({"time": [0.0, 0.2, 0.1, 0.3]}, "time goes backwards at sample 2"),
        ({"time": np.array(["2026-01-01", "NaT", "2026-01-03", "2026-01-04"], "M8[s]")}, "time is nan at sample 1"),
        ({"time": [0.0], "position": [1.0]}, "there are 1 samples; a recording holds at least 2"),
        ({"time": []}, "there are 0 samples"),
        ({"units": {"position": "furlong"}}, "units: position: the unit 'furlong' is not known; known units: 1, %"),
        ({"units": {"position": "kN"}}, "units: position: 'kN' cannot be converted to 'm'; allowed units: m, cm"),
        ({"units": {"time": "m"}}, "units: time: 'm' cannot be converted to 's'"),
        ({"units": {"force": "N"}}, "units force: there is no such signal; signals: time, position"),
        ({"roles": {"speed": "input"}}, "roles speed: there is no such signal"),
        ({"roles": {"position": "answer"}}, "the role is 'answer'; allowed: time, input, output, extra"),
        ({"extra": {"torque": F}}, "units torque: its unit is not given; give one, as in units={'torque': 'mm'}"),
        ({"extra": {"a/b": F}, "units": {"a/b": "1"}}, "'a/b' cannot be the name of a signal"),
        ({"force": ["10", "twenty", "30", "40"]}, "force: it holds something else than numbers"),
        ({"force": [{}, {}, {}, {}]}, "force: it holds something else than numbers"),
        ({"force": np.ones((4, 2))}, "/signals/force: the values have 2 dimensions"),
        ({"position": np.full(4, np.nan)}, "/signals/position: every sample is missing (NaN)"),
        ({"plant": {"stroke": 0.1}}, "plant stroke: it is not known of a plant; allowed: moving_mass_kg, stroke_m"),
        ({"plant": {"stroke_m": -0.1}}, "/plant: stroke_m: the value is -0.1"),
        ({"source": "web"}, "allowed: plant, rig, simulated"),
    ],
)
def test_what_cannot_be_is_named_in_one_line(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(BadInput) as caught:
        Recording.from_arrays(**({"time": T, "position": X} | arguments))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_misspelt_name_is_refused() -> None:
    with pytest.raises(TypeError, match="positon"):
        Recording.from_arrays(time=T, positon=X)  # type: ignore[call-arg]


def test_a_frame_is_read_by_its_headers() -> None:
    frame = DataFrame({"time_ms": 1e3 * T, "Position [mm]": X, "force (kN)": F, "note": ["a"] * 4})
    recording = Recording.from_dataframe(frame, title="rig")
    assert list(recording) == ["time", "position", "force"]
    np.testing.assert_allclose(recording.time, T)
    np.testing.assert_allclose(recording.si("position").values, 1e-3 * X)
    np.testing.assert_allclose(recording.si("force").values, 1e3 * F)
    assert recording.title == "rig"


def test_a_frame_is_read_by_the_columns_that_are_named() -> None:
    frame = DataFrame({"t": T, "travel": X, 7: F, "position": F, "position [mm]": F})
    recording = Recording.from_dataframe(
        frame, columns={"position": "travel", "wear": 7}, units={"position": "mm", "wear": "1"}, plant={"tag": "V-1"}
    )
    assert list(recording) == ["time", "position", "wear"]
    np.testing.assert_allclose(recording.si("position").values, 1e-3 * X)
    assert (recording["wear"].role, recording.plant.tag) == ("extra", "V-1")
    clocks = DataFrame({"t": T, "time": T, "position": X})
    assert list(Recording.from_dataframe(clocks, columns={"time": "t", "position": "position"})) == ["time", "position"]


@pytest.mark.parametrize(
    ("columns", "arguments", "words"),
    [
        ({"x": T}, {}, "columns time: no column is the time; name it; columns there: x"),
        (
            {"t": T},
            {"columns": {"position": "travel"}},
            "columns position: there is no column 'travel'; columns there: t",
        ),
        ({"t": T, "time": T}, {}, "columns time: the columns 't' and 'time' both say that they are it"),
        ({"t": T, "force": F}, {"units": {"position": "mm"}}, "units position: there is no such signal"),
    ],
)
def test_a_frame_that_does_not_fit_is_refused(columns: Any, arguments: Any, words: str) -> None:
    with pytest.raises(BadParameter) as caught:
        Recording.from_dataframe(DataFrame(columns), **arguments)
    assert words in str(caught.value)


@pytest.mark.parametrize("name", bundled_names())
def test_a_recording_goes_out_as_arrays_and_comes_back(name: str) -> None:
    recording = bundled(name)
    again = Recording.from_arrays(**recording.to_dict())
    assert set(again) == set(recording)
    assert (again.plant, again.title, again.source) == (recording.plant, recording.title, recording.source)
    for one in recording:
        np.testing.assert_array_equal(again[one].values, recording[one].values)
        assert (again[one].unit, again[one].role) == (recording[one].unit, recording[one].role)
