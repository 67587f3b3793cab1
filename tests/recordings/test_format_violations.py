"""Every rule of the file format, broken one at a time: each has words of its own, naming file, item and remedy."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from recording_samples import N_SAMPLES, TIME, contract_file

from recordings import BadInput, RecordingWriter, SignalSpec, read, validate

Change = Callable[[h5py.File], object]


def attribute(item: str, **values: object) -> Change:
    """Set attributes, or delete those that are None."""

    def change(file: h5py.File) -> None:
        for name, value in values.items():
            if value is None:
                del file[item].attrs[name]
            else:
                file[item].attrs[name] = value

    return change


def dataset(item: str, values: object, **attributes: object) -> Change:
    """Replace a dataset; attributes are kept unless given."""

    def change(file: h5py.File) -> None:
        kept = dict(file[item].attrs) if item in file else {}
        if item in file:
            del file[item]
        file.create_dataset(item, data=values).attrs.update(kept | attributes)

    return change


def declared(item: str, shape: tuple[int, ...], **storage: object) -> Change:
    """A dataset that declares a shape and was never filled."""

    def change(file: h5py.File) -> None:
        kept = dict(file[item].attrs)
        del file[item]
        file.create_dataset(item, shape, "f8", chunks=True, **storage).attrs.update(kept)

    return change


def moved(old: str, new: str) -> Change:
    return lambda file: file.move(old, new)


def changed_time(index: int, value: float) -> Change:
    return dataset("signals/time", np.where(np.arange(N_SAMPLES) == index, value, TIME))


NAN = np.full(N_SAMPLES, np.nan)
VIOLATIONS: dict[str, tuple[Change, str]] = {
    "no format": (attribute("/", format=None), "rec.h5: the root attribute format is missing; a recording says format"),
    "other format": (attribute("/", format="nexus"), "rec.h5: its format is 'nexus'; a recording says"),
    "format no text": (attribute("/", format=3), "rec.h5: attribute format is a number, not text"),
    "no version": (
        attribute("/", version=None),
        "the root attribute version is missing; this program reads versions 1",
    ),
    "newer version": (attribute("/", version=3), "its version is 3; this program reads versions 1 and 2; update this"),
    "older version": (
        attribute("/", version=0),
        "its version is 0; this program reads versions 1 and 2; the version is an",
    ),
    "version no integer": (attribute("/", version=1.5), "its version is 1.5"),
    "version text": (attribute("/", version="one"), "rec.h5: attribute version is text, not a number"),
    "no signals": (moved("signals", "other"), "/signals: the group is missing; a recording holds its signals there"),
    "signals no group": (dataset("signals", [1.0]), "/signals: it is not a group"),
    "no time": (moved("signals/time", "clock"), "/signals: no signal has the role 'time'; exactly one"),
    "time renamed": (
        moved("signals/time", "signals/t"),
        "/signals/t: the signal with the role 'time' has another name",
    ),
    "two times": (attribute("signals/force", role="time"), "2 signals have the role 'time': force, time"),
    "time in ms": (attribute("signals/time", unit="ms"), "/signals/time: the unit of time is 'ms'; time is in 's'"),
    "time stands": (changed_time(9, TIME[8]), "/signals/time: time repeats at sample 9: 0.08 after 0.08"),
    "time goes back": (changed_time(9, 0.0), "/signals/time: time goes backwards at sample 9: 0 after 0.08"),
    "time missing": (changed_time(9, np.nan), "/signals/time: time is nan at sample 9; time is finite"),
    "time infinite": (changed_time(39, np.inf), "/signals/time: time is inf at sample 39"),
    "no unit": (attribute("signals/force", unit=None), "/signals/force: the attribute unit is missing; every signal"),
    "unit a number": (attribute("signals/force", unit=1.0), "/signals/force: attribute unit is a number, not text"),
    "unit empty": (attribute("signals/gland_colour", unit=""), "/signals/gland_colour: the unit is empty; give"),
    "unit unknown": (
        attribute("signals/force", unit="furlong"),
        "/signals/force: the unit 'furlong' is not known; allowed",
    ),
    "unit of else": (attribute("signals/force", unit="bar"), "/signals/force: 'bar' is not a unit of force; allowed"),
    "no role": (attribute("signals/force", role=None), "/signals/force: the attribute role is missing; every signal"),
    "role unknown": (attribute("signals/force", role="cause"), "/signals/force: the role is 'cause'; allowed: time"),
    "resolution text": (attribute("signals/position", resolution="fine"), "attribute resolution is text, not a number"),
    "resolution negative": (attribute("signals/position", resolution=-1.0), "/signals/position: resolution is -1.0"),
    "noise not finite": (attribute("signals/position", noise_std=np.nan), "/signals/position: noise_std is nan"),
    "description list": (
        attribute("signals/position", description=np.zeros(3)),
        "/signals/position: attribute description is neither one text nor one number, not text",
    ),
    "text values": (
        dataset("signals/force", ["a"] * N_SAMPLES),
        "/signals/force: its values are of type object; a signal",
    ),
    "complex values": (dataset("signals/force", np.zeros(N_SAMPLES, complex)), "its values are of type complex128"),
    "truth values": (dataset("signals/force", np.ones(N_SAMPLES, bool)), "/signals/force: its values are of type bool"),
    "2-D": (
        dataset("signals/force", np.zeros((N_SAMPLES, 1))),
        "/signals/force: it has the shape (40, 1); a signal is",
    ),
    "scalar": (dataset("signals/force", 3.0), "/signals/force: it has the shape (); a signal is 1-D"),
    "group as signal": (lambda file: file.create_group("signals/x"), "/signals/x: it is not a dataset"),
    "short": (dataset("signals/force", TIME[1:]), "/signals/force: it has 39 samples, time has 40; all signals"),
    "one sample": (
        lambda file: [dataset(f"signals/{name}", [1.0])(file) for name in list(file["signals"])],
        "/signals/time: there are 1 samples; a recording holds at least 2",
    ),
    "no position": (dataset("signals/position", NAN), "/signals/position: every sample is missing (NaN); an output"),
    "no force": (dataset("signals/force", NAN), "/signals/force: every sample is missing (NaN); an input"),
    "huge count": (
        declared("signals/force", (10**15,), maxshape=(None,)),
        "/signals/force: it declares 1000000000000000 samples, but the file holds only 0 bytes for them",
    ),
    "other file's data": (
        lambda file: (
            file.move("signals/force", "f"),
            file.create_dataset("signals/force", (40,), "f8", external=[("/etc/passwd", 0, 320)]),
        ),
        "/signals/force: its data lies in another file; a recording is one file",
    ),
    "link elsewhere": (
        lambda file: (file.move("signals/force", "f"), _link(file, h5py.ExternalLink("other.h5", "/x"))),
        "/signals/force: it is a link into another file; a recording is one file",
    ),
    "broken link": (
        lambda file: (file.move("signals/force", "f"), _link(file, h5py.SoftLink("/nowhere"))),
        "/signals/force: it cannot be read",
    ),
    "plant no group": (dataset("plant", [1.0]), "/plant: it is not a group"),
    "mass zero": (attribute("plant", moving_mass_kg=0.0), "/plant: moving_mass_kg: the value is 0; moving_mass_kg is"),
    "stroke text": (attribute("plant", stroke_m="long"), "/plant: stroke_m: 'long' is not a number"),
    "area negative": (attribute("plant", diaphragm_area_m2=-0.1), "/plant: diaphragm_area_m2: the value is -0.1"),
    "spring negative": (attribute("plant", spring_constant_N_per_m=-1.0), "/plant: spring_constant_N_per_m: the value"),
    "preload infinite": (attribute("plant", spring_preload_N=np.inf), "/plant: spring_preload_N: the value is inf"),
    "stroke a list": (attribute("plant", stroke_m=np.zeros(3)), "/plant: stroke_m: it is neither one text nor one"),
    "tag a number": (attribute("plant", tag=7), "/plant: tag: int is not text; the tag is"),
    "title a number": (attribute("/", title=7), "rec.h5: attribute title is a number, not text"),
    "source unknown": (attribute("/", source="lab"), "attribute source: it is 'lab'; allowed: plant, rig, simulated"),
    "created no date": (attribute("/", created="yesterday"), "attribute created: 'yesterday' is not a date with"),
    "created no zone": (attribute("/", created="2026-11-21T09:30:00"), "created: '2026-11-21T09:30:00' is not a date"),
    "events no group": (dataset("events", [1.0]), "/events: it is not a group"),
    "events no kind": (moved("events/kind", "k"), "/events/kind: the dataset is missing; events have the columns"),
    "events differ": (dataset("events/time", [0.1]), "/events: its columns have 1 times, 2 kinds and 2 texts"),
    "events time text": (dataset("events/time", ["a", "b"]), "/events/time: its values are of type object; the times"),
    "events kind number": (dataset("events/kind", [1, 2]), "/events/kind: its values are of type int64; kinds and"),
    "events time nan": (dataset("events/time", [0.1, np.nan]), "/events: row 1: the time is nan; an event has"),
    "events huge": (declared("events/time", (10**12,), maxshape=(None,)), "/events/time: it declares 1000000000000"),
}


def _link(file: h5py.File, link: object) -> None:
    file["signals/force"] = link


@pytest.mark.parametrize("name", VIOLATIONS)
def test_each_violation_has_its_own_words(tmp_path: Path, name: str) -> None:
    change, words = VIOLATIONS[name]
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(BadInput) as caught:
        read(path)
    message = str(caught.value)
    assert words in message
    assert message.startswith(str(path))
    assert "\n" not in message
    assert message in map(str, validate(path))


def test_validate_tells_everything_that_is_wrong(tmp_path: Path) -> None:
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        for name in ("role unknown", "mass zero", "tag a number", "source unknown", "events differ", "short"):
            VIOLATIONS[name][0](file)
        VIOLATIONS["no position"][0](file)
    found = "\n".join(map(str, validate(path)))
    for words in ("39 samples", "moving_mass_kg", "int is not text", "'lab'", "1 times"):
        assert words in found
    assert found.count("\n") >= 4


def test_values_are_judged_beside_the_declarations(tmp_path: Path) -> None:
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        for name in ("time stands", "no position", "no force", "tag a number"):
            VIOLATIONS[name][0](file)
    places = [problem.where.rsplit("/", 1)[-1] for problem in validate(path)]
    assert places == ["time", "force", "position", "plant: tag"]


def test_many_equal_values_may_take_next_to_no_room(tmp_path: Path) -> None:
    n_samples, path = 1_000_000, tmp_path / "rec.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "valve-recording", "version": 1})
        time = file.create_dataset("signals/time", data=np.arange(n_samples))
        still = {"chunks": (n_samples,), "scaleoffset": 0, "compression": "gzip"}
        force = file.create_dataset("signals/force", data=np.ones(n_samples, "i8"), **still)
        time.attrs.update({"unit": "s", "role": "time"})
        force.attrs.update({"unit": "N", "role": "input"})
        assert force.id.get_storage_size() < 1000
    assert validate(path) == []
    assert read(path)["force"].values.sum() == n_samples


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-2000])


FILES: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (Path.unlink, "there is no such file; check the path"),
    "directory": (lambda path: (path.unlink(), path.mkdir()), "it is a directory; name one file inside it"),
    "pipe": (lambda path: (path.unlink(), os.mkfifo(path)), "it is not a regular file"),
    "empty": (lambda path: path.write_bytes(b""), "it is empty (0 bytes)"),
    "text": (lambda path: path.write_text("t,x\n0,1\n"), "it is not an HDF5 file"),
    "signature only": (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n"), "it cannot be read"),
    "truncated": (cut, "bytes are there; copy it again from its origin"),
}


@pytest.mark.parametrize("name", FILES)
def test_what_is_no_readable_file_is_said_in_one_line(tmp_path: Path, name: str) -> None:
    change, words = FILES[name]
    path = contract_file(tmp_path / "rec.h5")
    change(path)
    with pytest.raises(BadInput) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)
    assert [str(problem) for problem in validate(path)] == [str(caught.value)]


def test_a_file_without_permission_is_said_to_be_so(tmp_path: Path) -> None:
    path = contract_file(tmp_path / "rec.h5")
    path.chmod(0)
    me = os.geteuid()
    if me == 0:
        os.seteuid(65534)  # root may read everything
    try:
        with pytest.raises(BadInput, match="there is no permission to read it; ask its owner"):
            read(path)
    finally:
        os.seteuid(me)


def test_a_name_with_an_odd_byte_is_said_to_be_bad() -> None:
    with pytest.raises(BadInput, match="it cannot be opened"):
        read("a\0b.h5")


def test_a_signature_behind_a_user_block_is_found(tmp_path: Path) -> None:
    path = tmp_path / "block.h5"
    with h5py.File(path, "w", userblock_size=1024) as file:
        file.attrs["format"] = "other"
    with pytest.raises(BadInput, match="its format is 'other'"):
        read(path)


def test_a_recording_that_grows_can_be_read_and_one_that_was_cut_off_cannot(tmp_path: Path) -> None:
    path = tmp_path / "live.h5"
    specs = [SignalSpec("time", "s", "time"), SignalSpec("position", "m", "output")]
    with RecordingWriter(path, specs) as writer:
        with pytest.raises(BadInput, match="there are 0 samples"):
            read(path)
        writer.append({"time": [0.0, 0.1], "position": [1.0, 2.0]})
        assert len(read(path)) == 2
        writer.append({"time": [0.2], "position": [3.0]})
        assert len(read(path)) == 3
    (tmp_path / "live.h5.journal").write_bytes(b"left over")
    with pytest.raises(
        BadInput, match=r"it was cut off while recording; .* merge it first, into a new file by an import"
    ):
        read(path)
