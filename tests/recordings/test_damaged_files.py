"""Whatever bytes a file holds, reading it gives a valid recording or a `BadInput`, never anything else."""

from __future__ import annotations

import struct
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_samples import SPECS, contract_file, outcome, recording

from recordings import BadInput, Event, RecordingWriter, read, validate, write

Damage = tuple[int, list[tuple[float, int]]]


@pytest.fixture(scope="module")
def originals(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """The bytes of three intact files: by this program at once, by it while recording, and by h5py."""
    folder = tmp_path_factory.mktemp("originals")
    write(folder / "a.h5", recording(), truth={"fc": 1.0})
    with RecordingWriter(folder / "b.h5", SPECS, title="live", chunk_rows=16) as writer:
        writer.event(Event(0.0, "note", "begin"))
        for k in range(5):
            row = np.arange(10.0) + 10 * k
            writer.append({"time": row, "position": row, "force": row})
    contract_file(folder / "c.h5")
    return [(folder / f"{name}.h5").read_bytes() for name in "abc"]


def is_recording_or_bad_input(path: Path) -> None:
    """The one sentence this module tests, and that the validator agrees with the reader."""
    result = outcome(lambda: read(path))
    problems = validate(path)
    assert bool(problems) == isinstance(result, BadInput)
    assert "\n" not in "".join(map(str, [*problems, result]))


places = st.floats(0, 1, exclude_max=True)


@pytest.mark.slow
@given(st.integers(0, 2), st.lists(st.tuples(places, st.integers(0, 255)), min_size=1, max_size=20))
@settings(max_examples=60, deadline=None)
def test_flipped_bytes(
    originals: list[bytes], tmp_path_factory: pytest.TempPathFactory, which: int, flips: list[tuple[float, int]]
) -> None:
    data = bytearray(originals[which])
    for place, value in flips:
        data[int(place * len(data))] = value
    path = tmp_path_factory.mktemp("flip") / "rec.h5"
    path.write_bytes(data)
    is_recording_or_bad_input(path)


@pytest.mark.slow
@given(st.integers(0, 2), places, st.binary(max_size=40))
@settings(max_examples=40, deadline=None)
def test_cut_files_with_anything_behind(
    originals: list[bytes], tmp_path_factory: pytest.TempPathFactory, which: int, place: float, tail: bytes
) -> None:
    path = tmp_path_factory.mktemp("cut") / "rec.h5"
    path.write_bytes(originals[which][: int(place * len(originals[which]))] + tail)
    is_recording_or_bad_input(path)


ITEMS = ("/", "signals", "signals/time", "signals/position", "signals/force", "plant", "events", "events/text")
NAMES = ("format", "version", "title", "source", "created", "unit", "role", "resolution", "stroke_m", "tag", "new")
VALUES = st.one_of(
    st.none(),
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=5),
    st.binary(min_size=1, max_size=5).map(np.bytes_).filter(len),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(),
    st.booleans(),
    st.just(np.zeros(3)),
    st.just(np.zeros((2, 2), "i1")),
    st.just(h5py.Empty("f4")),
    st.just(np.zeros((), [("a", "i4"), ("b", "f8")])),
    st.just(complex(1, 2)),
)


@pytest.mark.slow
@given(st.lists(st.tuples(st.sampled_from(ITEMS), st.sampled_from(NAMES), VALUES), min_size=1, max_size=4))
@settings(max_examples=40, deadline=None)
def test_changed_and_deleted_attributes(
    originals: list[bytes], tmp_path_factory: pytest.TempPathFactory, changes: list[tuple[str, str, object]]
) -> None:
    path = tmp_path_factory.mktemp("attribute") / "rec.h5"
    path.write_bytes(originals[2])
    with h5py.File(path, "r+") as file:
        for item, name, value in changes:
            if value is not None:
                file[item].attrs[name] = value
            elif name in file[item].attrs:
                del file[item].attrs[name]
    is_recording_or_bad_input(path)


@pytest.mark.slow
@given(
    st.sampled_from([*ITEMS[1:], "events/time"]), st.sampled_from(["delete", "text", "group", "2-D", "short", "ref"])
)
@settings(max_examples=25, deadline=None)
def test_replaced_items(originals: list[bytes], tmp_path_factory: pytest.TempPathFactory, item: str, how: str) -> None:
    path = tmp_path_factory.mktemp("item") / "rec.h5"
    path.write_bytes(originals[2])
    values = {"text": ["a", "b"], "2-D": np.zeros((4, 4)), "short": np.zeros(1)}
    with h5py.File(path, "r+") as file:
        kept = dict(file[item].attrs)
        del file[item]
        if how == "group":
            file.create_group(item).attrs.update(kept)
        elif how == "ref":
            file.create_dataset(item, data=np.array([file.ref] * 40, dtype=h5py.ref_dtype)).attrs.update(kept)
        elif how != "delete":
            file.create_dataset(item, data=values[how]).attrs.update(kept)
    is_recording_or_bad_input(path)


def test_a_file_that_makes_the_library_take_gigabytes_is_refused(originals: list[bytes], tmp_path: Path) -> None:
    data = bytearray(originals[2])
    length = struct.pack("<I", len("valve-recording"))  # a text is stored as its length and where it lies
    place = data.find(length, data.find(b"format\0"))
    struct.pack_into("<I", data, place, 2**31 - 1)
    path = tmp_path / "rec.h5"
    path.write_bytes(data)
    with pytest.raises(
        BadInput, match=r"that the HDF5 library (asks for gigabytes of memory|never comes to an end) on it"
    ):
        read(path)


def test_a_file_on_which_the_library_never_returns_is_refused(originals: list[bytes], tmp_path: Path) -> None:
    data = bytearray(originals[1])
    heap = data.find(b"GCOL")  # where HDF5 keeps texts; a step of this size leads back to where it began
    struct.pack_into("<Q", data, heap + 24, 2**64 - 16)
    path = tmp_path / "rec.h5"
    path.write_bytes(data)
    with pytest.raises(
        BadInput, match=r"it is damaged so badly that the HDF5 library (never comes to an end|crashes) on"
    ):
        read(path)
