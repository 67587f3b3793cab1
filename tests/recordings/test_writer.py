"""The writer of a growing recording, when nothing dies."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import h5py
import numpy as np
import pytest
from dying_writer import values
from recording_samples import SPECS

from recordings import BadInput, Event, Plant, RecordingWriter, SignalSpec, read, validate
from recordings.hdf5 import live


def test_what_is_appended_is_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    began = datetime(2026, 11, 21, 9, 30, tzinfo=UTC)
    about = {"plant": Plant(stroke_m=0.04), "title": "rig", "source": "rig", "created": began}
    with RecordingWriter(path, SPECS, attributes={"operator": "Ada"}, **about) as writer:  # type: ignore[arg-type]
        writer.append(values(300))
        writer.append({"time": 0.5, "position": np.nan, "force": 3})
        writer.event(Event(0.5, "gap", "the line was down"))
        writer.event(Event(0.6, "note", "it is up"))
        assert len(writer) == 301
    made = read(path)
    assert validate(path) == []
    assert len(made) == 301
    assert np.isnan(made["position"].values[-1])
    assert (made.title, made.source, made.created, made.plant.stroke_m) == ("rig", "rig", began, 0.04)
    assert dict(made.attributes) == {"operator": "Ada"}
    assert [event.kind for event in made.events] == ["gap", "note"]
    assert [file.name for file in tmp_path.iterdir()] == ["run.h5"]


def test_the_journal_stays_small(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with RecordingWriter(path, SPECS, chunk_rows=4096) as writer:
        largest = 0
        for k in range(200):
            writer.append(values(2500, 2500 * k))
            largest = max(largest, (tmp_path / "run.h5.journal").stat().st_size)
    assert path.stat().st_size > 12e6
    assert largest < 1.5e6


def test_another_process_reads_while_it_grows(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    script = "import sys; from recordings import read; print(len(read(sys.argv[1])))"
    with RecordingWriter(path, SPECS) as writer:
        for n_rows in (50, 70):
            writer.append(values(n_rows, len(writer)))
            seen = subprocess.run([sys.executable, "-c", script, str(path)], capture_output=True, check=True)
            assert int(seen.stdout) == len(writer)
        plain = subprocess.run(
            [sys.executable, "-c", "import h5py, sys; h5py.File(sys.argv[1])", str(path)],
            capture_output=True,
            check=False,
        )
        assert b"BlockingIOError" in plain.stderr  # a program that would keep a lock is told so


@pytest.mark.parametrize(
    ("hold", "expected"),
    [
        (0.0, [*range(100, 2001, 100)]),
        (0.25, [*[100] * 3, *[400] * 3, *[700] * 3, *[1000] * 3, *[1300] * 3, *[1600] * 3, 1900, 2000]),
        (1e9, [*[100] * 6, *[700] * 3, *[1000] * 6, *[1600] * 4, 2000]),  # at most 512 rows, and up to a full chunk
    ],
)
def test_what_is_held_is_in_the_journal_and_comes_into_the_file_later(tmp_path: Path, hold, expected) -> None:
    path, journal = tmp_path / "run.h5", tmp_path / "run.h5.journal"
    with RecordingWriter(path, SPECS, chunk_rows=1000, hold=hold) as writer:
        seen = []
        for start in range(0, 2000, 100):
            before = journal.stat().st_size
            writer.append(values(100, start))
            assert journal.stat().st_size > before
            seen.append(len(read(path)))
    assert seen == expected
    np.testing.assert_array_equal(read(path)["force"].values, values(2000)["force"])


@pytest.mark.parametrize(
    ("batch", "words"),
    [
        (
            {"time": [1.0], "position": [1.0]},
            "a batch has the signals time, position; this recording takes exactly time,",
        ),
        ({"time": [1.0], "position": [1.0], "force": [1.0], "flow": [1.0]}, "position, force, flow; this recording"),
        ({"time": [1.0, 2.0], "position": [1.0], "force": [1.0]}, r"columns of the shapes \(2,\), \(1,\), \(1,\)"),
        ({"time": [], "position": [], "force": []}, "all have one length of 1 or more"),
        ({"time": [[1.0]], "position": [[1.0]], "force": [[1.0]]}, r"\(1, 1\)"),
        ({"time": [0.2], "position": [1.0], "force": [1.0]}, "sample 10: time goes backwards"),
        ({"time": [0.9], "position": [1.0], "force": [1.0]}, "time repeats at sample 0: 0.9 after 0.9"),
        ({"time": [1.0, np.nan], "position": [1.0, 1.0], "force": [1.0, 1.0]}, "time is nan at sample 1"),
    ],
)
def test_a_batch_that_does_not_fit_is_refused_and_the_next_one_is_taken(
    tmp_path: Path, batch: dict[str, object], words: str
) -> None:
    path = tmp_path / "run.h5"
    row = np.arange(10) / 10
    with RecordingWriter(path, SPECS) as writer:
        writer.append({"time": row, "position": row, "force": row})
        with pytest.raises(BadInput, match=words):
            writer.append(batch)  # type: ignore[arg-type]
        writer.append({"time": [1.0], "position": [1.0], "force": [1.0]})
    assert len(read(path)) == 11


def test_a_run_makes_a_new_file(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with RecordingWriter(path, SPECS) as writer:
        writer.append(values(5))
    with pytest.raises(BadInput, match="it exists already; a run makes a new file"):
        RecordingWriter(path, SPECS)
    with RecordingWriter(path, SPECS, overwrite=True) as writer:
        writer.append(values(7))
    assert len(read(path)) == 7
    (tmp_path / "other.h5.journal").write_bytes(b"")
    with pytest.raises(BadInput, match="the journal of an interrupted run is there; recover that run"):
        RecordingWriter(tmp_path / "other.h5", SPECS)
    with pytest.raises(BadInput, match="the folder does not exist"):
        RecordingWriter(tmp_path / "no" / "run.h5", SPECS)
    with pytest.raises(BadInput, match="no signal has the role 'time'"):
        RecordingWriter(tmp_path / "new.h5", SPECS[1:])
    with pytest.raises(BadInput, match="two signals share a name"):
        RecordingWriter(tmp_path / "new.h5", [*SPECS, SignalSpec("force", "kN", "input")])
    assert not (tmp_path / "new.h5").exists()


def test_a_disk_that_is_full_from_the_start_is_left_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    for name in ("pwrite", "fsync"):
        with monkeypatch.context() as patch:
            patch.setattr(os, name, full)
            with pytest.raises(BadInput, match="the disk is full; make room, or choose another folder"):
                RecordingWriter(tmp_path / "run.h5", SPECS)
        assert list(tmp_path.iterdir()) == []


def test_a_closed_writer_takes_nothing_and_closes_twice(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "run.h5", SPECS)
    writer.append(values(5))
    writer.close()
    writer.close()
    with pytest.raises(BadInput, match="it is closed; close it and record into a new file"):
        writer.append(values(5, 5))
    with pytest.raises(BadInput, match="it is closed"):
        writer.event(Event(0.0, "note", "late"))


def test_an_error_in_the_block_still_finishes_the_file(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"

    def record_and_fail() -> None:
        with RecordingWriter(path, SPECS) as writer:
            writer.append(values(5))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        record_and_fail()
    assert len(read(path)) == 5


FULL_DISK = """
import resource, signal, sys
from dying_writer import values
from recording_samples import SPECS
from recordings import BadInput, RecordingWriter
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a limit on the size of files behaves like a full disk
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
writer = RecordingWriter(sys.argv[1], SPECS, chunk_rows=256)
try:
    while True:
        writer.append(values(100, len(writer)))
except BadInput as error:
    print(len(writer), error, sep="\\n")
try:
    writer.append(values(100, len(writer)))
except BadInput as error:
    print(error)
if sys.argv[3] == "room":
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
try:
    writer.close()
except BadInput as error:
    print(error)
"""


@pytest.mark.parametrize("limit", [30_000, 100_000, 100_001, 300_000])
@pytest.mark.parametrize("later", ["room", "full"])
def test_a_full_disk_keeps_what_was_acknowledged(tmp_path: Path, limit: int, later: str) -> None:
    from recordings import recover

    path = tmp_path / "run.h5"
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(path), str(limit), later],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parent,
    )
    assert (done.returncode, done.stderr) == (0, "")  # HDF5 itself would crash the interpreter at its end
    acknowledged, *messages = done.stdout.splitlines()
    assert "the file grew larger than allowed here" in messages[0]
    assert "an earlier write failed; close it and record into a new file" in messages[1]
    assert len(messages) == (2 if later == "room" else 3)
    assert recover(path).merged == (later == "full")
    made = read(path)
    assert len(made) >= int(acknowledged)
    np.testing.assert_array_equal(made["force"].values, np.arange(len(made)))
    with h5py.File(path) as file:
        assert file["signals/time"].shape == (len(made),)


# The files are taken away, or somebody else wants the name


def removed(path: Path) -> None:
    path.unlink()


def moved(path: Path) -> None:
    path.rename(path.with_name("elsewhere.h5"))


def replaced(path: Path) -> None:
    path.unlink()
    path.write_bytes(b"something else")


def truncated(path: Path) -> None:
    os.truncate(path, 3000)


@pytest.mark.parametrize("hold", [0.0, 1e9])
@pytest.mark.parametrize(
    ("harm", "words"),
    [(removed, "removed or moved"), (moved, "removed or moved"), (replaced, "another file"), (truncated, "truncated")],
)
def test_a_recording_that_is_taken_away_is_noticed_with_the_next_batch(
    tmp_path: Path, harm, words: str, hold: float
) -> None:
    path = tmp_path / "run.h5"
    writer = RecordingWriter(path, SPECS, hold=hold)
    writer.append(values(50))
    writer.append(values(50, 50))
    harm(path)
    with pytest.raises(BadInput, match=words):
        writer.append(values(100, 100))
    writer.close()
    np.testing.assert_array_equal(read(path)["time"].values[:100], values(100)["time"])


@pytest.mark.parametrize("hold", [0.0, 1e9])
@pytest.mark.parametrize("harm", [removed, moved, replaced, truncated])
def test_a_recording_that_is_taken_away_before_it_is_closed_is_put_back(tmp_path: Path, harm, hold: float) -> None:
    path = tmp_path / "run.h5"
    writer = RecordingWriter(path, SPECS, hold=hold)
    writer.append(values(50))
    writer.append(values(50, 50))
    harm(path)
    writer.close()
    np.testing.assert_array_equal(read(path)["time"].values, values(100)["time"])
    assert not path.with_name("run.h5.journal").exists()


def test_full_chunks_of_a_recording_that_is_removed_are_put_back(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    writer = RecordingWriter(path, SPECS, chunk_rows=4096)
    for start in range(0, 60_000, 5000):
        writer.append(values(5000, start))
    path.unlink()
    writer.close()
    np.testing.assert_array_equal(read(path)["time"].values, values(60_000)["time"])


def test_of_two_writers_on_one_name_one_is_refused_and_the_other_keeps_its_file(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "run.h5"
    first: list[RecordingWriter] = []
    vacant = live.check_vacant

    def overtaken(*arguments: object, **options: object) -> None:
        vacant(*arguments, **options)
        if not first:
            first.append(None)
            first[0] = RecordingWriter(path, SPECS)

    monkeypatch.setattr(live, "check_vacant", overtaken)
    with pytest.raises(BadInput, match="exists already"):
        RecordingWriter(path, SPECS)
    first[0].append(values(10))
    first[0].close()
    assert len(read(path)) == 10
