"""Recordings to pandas, Parquet and MATLAB and back: nothing may be lost."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from recordings import QUALITIES, BadInput, Event, Plant, Recording, Signal, read, write_table
from recordings.exchange import parts_of_table
from recordings.importers import import_to
from recordings.importers.exported import read_exported

TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)
NAMES = TEXTS.filter(lambda text: text.strip() and "/" not in text and text not in {".", "..", "time"})
FINITE = st.floats(allow_nan=False, allow_infinity=False)
OFFSETS = st.integers(-1439, 1439).map(lambda minutes: timezone(timedelta(minutes=minutes)))
RESERVED = {"format", "version", "title", "source", "created", "journal"}


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    """Recordings with everything that one can have."""
    n = draw(st.integers(2, 6))
    steps = draw(arrays(float, n, elements=st.floats(1e-6, 1e3)))
    time = np.cumsum(steps) + draw(st.floats(-1e3, 1e3))
    names = draw(st.lists(NAMES, min_size=1, max_size=3, unique=True))
    texts = st.one_of(st.none(), TEXTS)
    amounts = st.one_of(st.none(), st.floats(0, 1e9))
    values = arrays(float, n, elements=st.floats(allow_infinity=False))
    units = st.just("furlong")
    known = {"position": "mm", "force": "kN", "setpoint": "%"}
    signals = [Signal("time", time, "s", "time")]
    for name in dict.fromkeys((*names, *draw(st.sets(st.sampled_from(sorted(known)))))):
        unit = known.get(name) or draw(units)
        role = draw(st.sampled_from(["input", "output", "extra"]))
        signals.append(Signal(name, draw(values), unit, role, draw(texts), draw(amounts), draw(amounts)))
    others = [signal.name for signal in signals[1:]]
    details = {}
    if draw(st.booleans()):
        codes = arrays(np.uint8, n, elements=st.integers(0, len(QUALITIES) - 1))
        details["quality"] = {name: draw(codes) for name in others}
        details["reply_times"] = {name: draw(values) for name in others}
    events = st.builds(Event, FINITE, TEXTS, TEXTS)
    free = st.one_of(TEXTS, FINITE, st.integers(-(2**62), 2**62))
    keys = TEXTS.filter(lambda text: text and text not in RESERVED)
    created = st.datetimes(datetime(1970, 1, 1), datetime(2100, 1, 1), timezones=OFFSETS)
    return Recording.of(
        signals, plant=Plant(stroke_m=draw(st.one_of(st.none(), st.floats(1e-6, 10))), tag=draw(texts)),
        title=draw(texts), source=draw(st.sampled_from([None, "plant", "rig", "simulated"])),
        created=draw(st.one_of(st.none(), created)), events=tuple(draw(st.lists(events, max_size=2))),
        attributes=draw(st.dictionaries(keys, free, max_size=3)), **details,
    )  # fmt: skip


def assert_same(found: Recording, given: Recording) -> None:
    """All of two recordings is the same but the paths of their files."""
    assert list(found.signals) == list(given.signals)
    assert found.header == given.header
    assert found.events == given.events
    assert found.created == given.created
    if given.created is not None and found.created is not None:
        assert found.created.utcoffset() == given.created.utcoffset()
    assert {name: type(value) for name, value in found.attributes.items()} == {
        name: type(value) for name, value in given.attributes.items()
    }
    for name, signal in given.signals.items():
        assert found[name].values.tobytes() == signal.values.tobytes(), name
    for group in ("quality", "reply_times"):
        assert {n: a.tobytes() for n, a in getattr(found, group).items()} == {
            n: a.tobytes() for n, a in getattr(given, group).items()
        }


@given(recordings())
@settings(max_examples=40, deadline=None, derandomize=True)
def test_a_data_frame_loses_nothing(recording):
    pytest.importorskip("pandas")
    assert_same(Recording.from_dataframe(recording.to_dataframe()), recording)


@pytest.mark.parametrize(("form", "ending"), [("parquet", ".parquet"), ("matlab", ".mat")])
def test_a_file_loses_nothing(form, ending):
    if form == "parquet":
        pytest.importorskip("pyarrow")

    @given(recordings())
    @settings(max_examples=12, deadline=None, derandomize=True)
    def there_and_back(recording):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"table{ending}")
            write_table(path, recording, form)
            table = read_exported(path)
            assert table is not None
            assert_same(Recording(**parts_of_table(table, "table")), recording)

    there_and_back()


def test_a_data_frame_is_taken_as_it_is_now():
    pytest.importorskip("pandas")
    recording = read_steps()
    frame = recording.to_dataframe()
    frame["position"] *= 2.0
    frame["note"] = 1.0
    found = Recording.from_dataframe(frame.iloc[5:10])
    assert list(found) == list(recording)
    assert len(found) == 5
    assert np.array_equal(found["position"].values, 2.0 * recording["position"].values[5:10])
    assert found["position"].unit == "mm"


CHANGES = {"signals": {"position": {"column": 2, "unit": "m"}}, "time": {"unit": "s"}}


@pytest.mark.parametrize(("form", "ending"), [("parquet", ".parquet"), ("matlab", ".mat")])
def test_an_exported_file_is_imported_whole(tmp_path, form, ending):
    if form == "parquet":
        pytest.importorskip("pyarrow")
    write_table(tmp_path / f"a{ending}", read_steps(), form)
    assert import_to(tmp_path / f"a{ending}", tmp_path / "a.h5") == ()
    assert_same(read(tmp_path / "a.h5"), read_steps())


def test_options_go_before_what_a_file_says(tmp_path):
    pytest.importorskip("pyarrow")
    write_table(tmp_path / "a.parquet", read_steps(), "parquet")
    import_to(tmp_path / "a.parquet", tmp_path / "a.h5", changes=CHANGES)
    assert read(tmp_path / "a.h5")["position"].values.max() == pytest.approx(19.0)  # metres, as was asked


@pytest.mark.parametrize("about", ["{}", "[1", '{"signals": [{"name": "time", "unit": "s", "role": "boss"}]}'])
def test_a_wrong_text_is_refused_in_one_line(tmp_path, about):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"time": [0.0, 1.0], "position": [0.0, 1.0]})
    frame.attrs["bristle_recording"] = about
    with pytest.raises(BadInput, match="what is said about the recording"):
        Recording.from_dataframe(frame)


def test_a_column_that_is_gone_is_named():
    pytest.importorskip("pandas")
    frame = read_steps().to_dataframe().drop(columns="position")
    with pytest.raises(BadInput, match="'position' is not there"):
        Recording.from_dataframe(frame)


def read_steps() -> Recording:
    """Twenty samples with a creation date."""
    time = np.arange(20) / 10
    signals = [Signal("time", time, "s", "time"), Signal("position", np.arange(20.0), "mm", "output")]
    recording = Recording.of(signals, title="steps", created=datetime(2026, 11, 21, tzinfo=UTC))
    return replace(recording, attributes={"operator": "Ada"})
