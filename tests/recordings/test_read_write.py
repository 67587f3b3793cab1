"""Recordings written and read back: nothing lost, nothing half-written, memory in proportion."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from recording_samples import FORCE, N_SAMPLES, POSITION, SPECS, TIME, assert_same, contract_file, recording

from recordings import (
    UNITS,
    BadInput,
    Event,
    Plant,
    Recording,
    RecordingWriter,
    Signal,
    bundled,
    bundled_names,
    open_recording,
    read,
    read_truth,
    save_json,
    save_text,
    validate,
    write,
)

texts = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
names = st.text(st.characters(codec="utf-8", exclude_characters="\0/"), min_size=1, max_size=12).filter(
    lambda name: name.strip() and name not in {".", "..", "time"}
)
sizes = st.floats(0, 1e6)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    """Any recording: free names, any known unit, gaps, missing samples, every optional field."""
    steps = draw(hnp.arrays(np.float64, st.integers(2, 30), elements=st.floats(1e-3, 1e3)))
    signals = [Signal("time", np.cumsum(steps), "s", "time")]
    for name in draw(st.sets(names.filter(lambda name: name not in {"position", "force"}), max_size=3)):
        values = draw(hnp.arrays(np.float64, len(steps), elements=st.floats(width=64)))
        about = draw(st.tuples(st.none() | texts, st.none() | sizes, st.none() | sizes))
        symbol = draw(st.sampled_from(sorted(UNITS)) | names)
        signals.append(_signal_or_extra(name, values, symbol, about))
    attributes = st.dictionaries(
        names.filter(lambda name: name not in {"format", "version", "title", "source", "created", "journal"}),
        texts | st.floats(allow_nan=False) | st.integers(-(2**63) + 1, 2**63 - 1),
        max_size=3,
    )
    event = st.builds(Event, st.floats(-1e9, 1e9), texts, texts)
    plant = st.builds(Plant, st.none() | st.floats(1e-3, 1e3), tag=st.none() | texts)
    zone = timezone(timedelta(hours=draw(st.integers(-12, 12))))
    return Recording.of(
        signals,
        plant=draw(plant),
        title=draw(st.none() | texts),
        source=draw(st.sampled_from([None, "plant", "rig", "simulated"])),
        created=draw(st.none() | st.datetimes(timezones=st.just(zone))),
        events=tuple(draw(st.lists(event, max_size=3))),
        attributes=draw(attributes),
    )


def _signal_or_extra(name: str, values: Any, symbol: str, about: tuple[Any, Any, Any]) -> Signal:
    try:
        return Signal(name, values, symbol, "extra", *about)
    except BadInput:  # a name the toolkit understands, with a unit of something else
        return Signal(f"my {name}", values, symbol, "extra", *about)


@pytest.mark.slow
@given(recordings())
@settings(max_examples=40, deadline=None)
def test_any_recording_comes_back_as_it_was_written(tmp_path_factory: pytest.TempPathFactory, made: Recording) -> None:
    path = tmp_path_factory.mktemp("round") / "rec.h5"
    write(path, made)
    assert validate(path) == []
    assert_same(read(path), made)


def test_a_file_made_by_others_reads_with_all_it_says(tmp_path: Path) -> None:
    path = contract_file(tmp_path / "rec.h5")
    made = read(path)
    assert validate(path) == []
    assert set(made) == {"time", "position", "force", "gland_colour"}
    assert (made.title, made.source, made.plant.tag, made.plant.spring_preload_N) == ("steps", "rig", "LC74_20", -3.0)
    assert made.created == datetime(2026, 11, 21, 8, 30, tzinfo=UTC)
    assert made.events == (Event(0.1, "note", "começo"), Event(0.2, "fault", "sticks"))
    assert dict(made.attributes) == {"operator": "Ada", "run": 7, "ambient": 21.5}
    assert (made["position"].description, made["position"].resolution) == ("stem", 0.01)
    np.testing.assert_allclose(made.si("position").values, POSITION)
    assert len(made.sha256 or "") == 64


@pytest.mark.parametrize("dtype", ["<f4", ">f8", "<i2", "u1", ">i8"])
def test_any_numeric_type_of_any_byte_order_is_read_as_numbers(tmp_path: Path, dtype: str) -> None:
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        del file["signals/force"]
        dataset = file.create_dataset("signals/force", data=np.arange(N_SAMPLES).astype(dtype))
        dataset.attrs.update({"unit": "N", "role": "input"})
    np.testing.assert_array_equal(read(path)["force"].values, np.arange(N_SAMPLES))


def test_texts_of_fixed_length_and_numbers_in_arrays_of_one_are_read(tmp_path: Path) -> None:
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["title"] = np.bytes_("från MATLAB".encode())
        file["plant"].attrs["stroke_m"] = np.array([0.05])
        file["signals/force"].attrs["unit"] = np.array(["N"], dtype=h5py.string_dtype())
        del file["events/text"]
        file["events/text"] = np.array([b"a", b"b"])
    made = read(path)
    assert (made.title, made.plant.stroke_m, made["force"].unit) == ("från MATLAB", 0.05, "N")
    assert made.events[1].text == "b"


def test_only_the_named_signals_are_read(tmp_path: Path) -> None:
    path = contract_file(tmp_path / "rec.h5")
    assert list(read(path, ["force"])) == ["time", "force"]
    with pytest.raises(BadInput, match=r"no signal 'flow'; signals there: .*force"):
        read(path, ["flow"])
    with open_recording(path) as file:
        assert len(file) == N_SAMPLES
        assert file.specs["position"].unit == "mm"
        np.testing.assert_array_equal(file.signal("force").values, FORCE)


def test_the_truth_is_kept_apart(tmp_path: Path) -> None:
    path = tmp_path / "rec.h5"
    write(path, recording(), truth={"fc": 12.5, "effect": "backlash", "z": POSITION})
    truth = read_truth(path)
    assert (truth["fc"], truth["effect"]) == (12.5, "backlash")
    np.testing.assert_array_equal(truth["z"], POSITION)
    with h5py.File(path, "r+") as file:
        del file["truth"]
        file["truth"] = 0  # reading would stumble over it
    assert_same(read(path), recording())
    write(path, recording())
    assert read_truth(path) == {}
    with pytest.raises(BadInput, match="/truth: 'a/b' cannot be a name there"):
        write(path, recording(), truth={"a/b": 1.0})


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "rec.h5"
    write(path, recording())
    before = path.read_bytes()

    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    with pytest.raises(BadInput, match=r"rec.h5: the disk is full; make room, or choose another folder"):
        write(path, Recording.of([Signal("time", TIME, "s", "time")]))
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["rec.h5"]


def test_what_cannot_be_written_is_said_in_words(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadInput, match="the folder does not exist; make it first"):
        write(tmp_path / "no" / "rec.h5", recording())
    with pytest.raises(BadInput, match="its folder is a file"):
        write(tmp_path / "file" / "rec.h5", recording())
    with pytest.raises(BadInput, match="it is a directory"):
        write(tmp_path / "folder", recording())
    with pytest.raises(BadInput, match="the name is too long"):
        write(tmp_path / ("a" * 250), recording())
    with pytest.raises(BadInput, match="it exists already; choose another name"):
        write(tmp_path / "file", recording(), overwrite=False)
    with pytest.raises(BadInput, match="the folder does not exist"):
        save_text(tmp_path / "no" / "page.html", "words")


def test_a_recording_that_is_replaced_takes_its_journal_with_it(tmp_path: Path) -> None:
    path, journal = tmp_path / "run.h5", tmp_path / "run.h5.journal"
    writer = RecordingWriter(path, recording().header.signals)
    with pytest.raises(BadInput, match="another process is recording into it; choose another name"):
        write(path, recording())
    writer.close()
    journal.write_bytes(b"of an interrupted run")
    with pytest.raises(BadInput, match="it exists already; choose another name, or allow overwriting"):
        write(path, recording(), overwrite=False)
    assert journal.exists()
    write(path, recording())
    assert not journal.exists()
    assert_same(read(path), recording())


def test_the_same_recording_makes_the_same_file(tmp_path: Path) -> None:
    write(tmp_path / "a.h5", recording())
    write(tmp_path / "b.h5", recording())
    assert read(tmp_path / "a.h5").sha256 == read(tmp_path / "b.h5").sha256


MEMORY = """
import re, sys
from pathlib import Path
from recordings import read

def peak():  # not ru_maxrss: that one is inherited from the parent process
    return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024

before = peak()
made = read(sys.argv[1], sys.argv[2:])
print(peak() - before, len(made))
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is read from /proc")
def test_memory_is_in_proportion_to_the_signals_asked_for(tmp_path: Path) -> None:
    n_samples, path = 10_000_000, tmp_path / "long.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "valve-recording", "version": 1})
        file["signals/time"] = np.arange(n_samples, dtype="i4")
        for name in ("position", "force", "pressure", "flow"):
            file[f"signals/{name}"] = np.ones(n_samples, "i1")
        units = {"time": "s", "position": "m", "force": "N", "pressure": "Pa", "flow": "m3/h"}
        for name, symbol in units.items():
            file[f"signals/{name}"].attrs.update({"unit": symbol, "role": "time" if name == "time" else "extra"})

    def megabytes(*wanted: str) -> float:
        command = [sys.executable, "-c", MEMORY, str(path), *wanted]
        used, length = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
        assert int(length) == n_samples
        return float(used)

    one, four = megabytes("force"), megabytes("position", "force", "pressure", "flow")
    signal = 8 * n_samples / 2**20
    assert one < 2 * signal + 40  # time and one signal
    assert four - one == pytest.approx(3 * signal, rel=0.05)


def test_bundled_recordings_open_by_name() -> None:
    for name in bundled_names():
        assert len(bundled(name)) > 100
    with pytest.raises(BadInput, match="nothing like it: there is no bundled recording of that name; names there:"):
        bundled("nothing like it")


def test_a_result_is_written_as_json_with_null_for_what_is_not_finite(tmp_path):
    path = tmp_path / "result.json"
    save_json(path, {"a": np.float32(1.5), "b": [np.nan, float("inf"), (2.0,)], "c": np.bool_(True), "d": {"e": None}})
    assert json.loads(path.read_text()) == {"a": 1.5, "b": [None, None, [2.0]], "c": True, "d": {"e": None}}


# Version 2: the quality and the reply time of each value

DETAILS = {
    "quality": {"position": [0, 1, 2, 4], "force": [0, 0, 3, 0]},
    "reply_times": {"position": [0.001, 0.011, 0.021, np.nan], "force": [0.002, 0.012, 0.022, 0.032]},
}
BATCH = {"time": [0.0, 0.01, 0.02, 0.03], "position": [1.0, np.nan, np.nan, np.nan], "force": [1.0, 2.0, np.nan, 4.0]}


def detailed(path: Path) -> Path:
    with RecordingWriter(path, SPECS, per_value=True, chunk_rows=3) as writer:
        for k in range(4):
            rows = [{name: one[k] for name, one in part.items()} for part in (BATCH, *DETAILS.values())]
            writer.append(*rows)
    return path


def test_a_recording_of_version_2_keeps_the_quality_and_the_time_of_each_value(tmp_path):
    recording = read(detailed(tmp_path / "two.h5"))
    for group, expected in DETAILS.items():
        for name, values in expected.items():
            np.testing.assert_array_equal(getattr(recording, group)[name], values)
    write(tmp_path / "copy.h5", recording)
    copied = read(tmp_path / "copy.h5", ["force"])
    assert copied.quality["force"].tolist() == DETAILS["quality"]["force"]
    assert validate(tmp_path / "two.h5") == validate(tmp_path / "copy.h5") == []
    with h5py.File(tmp_path / "two.h5") as file:
        assert file.attrs["version"] == 2
        assert file["quality/position"].dtype == np.uint8
    assert pickle.loads(pickle.dumps(recording)).quality["position"].tolist() == DETAILS["quality"]["position"]


def test_a_recording_without_qualities_is_written_as_version_1(tmp_path):
    write(tmp_path / "one.h5", recording())
    with h5py.File(tmp_path / "one.h5") as file:
        assert file.attrs["version"] == 1
        assert "quality" not in file
    assert not read(tmp_path / "one.h5").quality


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda file: file.pop("quality"), "/quality: the group is missing"),
        (lambda file: file["reply_times"].pop("force"), "/reply_times/force: the dataset is missing"),
        (lambda file: file["quality/force"].resize((3,)), "/quality/force: it has 3 values, the signal has 4"),
        (lambda file: file["quality/force"].write_direct(np.full(4, 9, "u1")), "the code 9 of sample 0 is no quality"),
    ],
)
def test_what_version_2_needs_and_is_not_there_is_named(tmp_path, change, words):
    path = detailed(tmp_path / "two.h5")
    with h5py.File(path, "r+") as file:
        change(file)
    assert words in str(validate(path)[0])
    with pytest.raises(BadInput, match=words):
        read(path)
