"""Nothing acknowledged is lost: to a killed process, a power cut, or a recovery that is itself cut short."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np
import pytest
from dying_writer import ROW_S, values
from recording_samples import SPECS

from recordings import BadInput, Event, Recording, RecordingWriter, describe, read, recover, validate

BATCH = 1000
SCRIPT = Path(__file__).with_name("dying_writer.py")


def assert_holds(path: Path, n_samples: int) -> Recording:
    """The recording is valid and holds the first samples, at least so many of them, exactly."""
    assert validate(path) == []
    made = read(path)
    assert len(made) >= n_samples
    for name, expected in values(len(made)).items():
        np.testing.assert_array_equal(made[name].values, expected)
    return made


def journal_of(path: Path) -> Path:
    return path.with_name(path.name + ".journal")


def doomed(folder: Path, seeds: Iterable[int]) -> tuple[subprocess.Popen[bytes], dict[int, BinaryIO]]:
    """Start one writing process a seed; what each of them reports, by seed."""
    for seed in seeds:
        os.mkfifo(folder / f"{seed}.acknowledged")
    command = [sys.executable, str(SCRIPT), str(folder), *map(str, seeds)]
    nursery = subprocess.Popen(command, stderr=subprocess.PIPE)
    return nursery, {seed: open(folder / f"{seed}.acknowledged", "rb") for seed in seeds}


def stop(report: BinaryIO, rng: np.random.Generator, number: signal.Signals) -> int:
    """Send a signal after a random number of batches and a random instant more; the samples acknowledged by then."""
    (process,) = struct.unpack("<q", report.read(8))
    data = report.read(8 * int(rng.integers(1, 60)))
    time.sleep(rng.uniform(0, 0.004))  # not to wait for anything: the instant itself is what is tested
    os.kill(process, number)
    data += report.read()
    report.close()
    return int(struct.unpack("<q", data[-8:])[0])


@pytest.mark.parametrize("group", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 5))])
def test_a_killed_process_loses_nothing_acknowledged(tmp_path: Path, group: int) -> None:
    """Fifty moments in all, ten processes at once."""
    rng = np.random.default_rng(group)
    nursery, reports = doomed(tmp_path, range(10 * group, 10 * group + 10))
    acknowledged = {seed: stop(report, rng, signal.SIGKILL) for seed, report in reports.items()}
    nursery.communicate()
    for seed, n_samples in acknowledged.items():
        path = tmp_path / f"{seed}.h5"
        with h5py.File(path, "r") as file:  # plain h5py opens it before anything is put right
            assert set(file["signals"]) == {"time", "position", "force"}
        with pytest.raises(BadInput, match="it was cut off while recording"):
            read(path)
        recovery = recover(path)
        assert (recovery.merged, recovery.lost) == (True, ())
        made = assert_holds(path, n_samples)
        assert len(made) == recovery.n_samples
        assert made.title == f"seed {seed}"
        assert all(event.text == f"at {round(event.time / ROW_S)}" for event in made.events)
        assert not journal_of(path).exists()


@pytest.mark.slow
def test_ctrl_c_leaves_a_finished_file(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    nursery, reports = doomed(tmp_path, range(8))
    acknowledged = {seed: stop(report, rng, signal.SIGINT) for seed, report in reports.items()}
    _, words = nursery.communicate()
    assert words.count(b"Traceback") == words.count(b"\nKeyboardInterrupt") == 8  # and not one word of HDF5
    for seed, n_samples in acknowledged.items():
        assert not journal_of(tmp_path / f"{seed}.h5").exists()
        assert_holds(tmp_path / f"{seed}.h5", n_samples)


class Disk:
    """What a disk holds of a recording when the power is cut: what was forced onto it, and any part of the rest."""

    def __init__(self, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.path, self.forced = path, {}  # type: tuple[Path, dict[str, bytes]]
        monkeypatch.setattr(os, "fsync", self._fsync)

    def cut(self, rng: np.random.Generator, folder: Path) -> Path:
        """A copy of the two files as a power cut now could leave them."""
        path = folder / self.path.name
        path.write_bytes(self._torn_pages(rng, self.forced[self.path.name], self.path.read_bytes()))
        journal = journal_of(self.path)
        now, safe = journal.read_bytes(), len(self.forced[journal.name])
        assert now[:safe] == self.forced[journal.name]
        journal_of(path).write_bytes(now[: int(rng.integers(safe, len(now) + 1))])
        return path

    def _fsync(self, descriptor: int) -> None:
        file = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
        if file.is_file():
            name = file.name if file.name == self.path.name else journal_of(self.path).name
            self.forced[name] = file.read_bytes()

    @staticmethod
    def _torn_pages(rng: np.random.Generator, old: bytes, new: bytes) -> bytes:
        """Every page is the old or the new one, and the file has the old or the new length."""
        length = len(old) if rng.random() < 0.3 else len(new)
        share, pages = rng.random(), []
        for start in range(0, length, 512):
            page = (new if rng.random() < share else old)[start : start + 512]
            pages.append(page.ljust(min(512, length - start), b"\0"))
        return b"".join(pages)


@pytest.fixture
def crash_folders(tmp_path: Path) -> Iterator[Path]:
    return (folder for k in range(10_000) if not (folder := tmp_path / f"crash{k}").mkdir())


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="what is forced onto the disk is followed through /proc")
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 3))])
def test_a_power_cut_loses_nothing_acknowledged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, crash_folders: Iterator[Path], seed: int
) -> None:
    """The HDF5 file is torn page by page, the journal at any byte that was not forced onto the disk."""
    rng, path, n_samples = np.random.default_rng(seed), tmp_path / "run.h5", 0
    disk = Disk(path, monkeypatch)
    with RecordingWriter(path, SPECS, title="rig 4", chunk_rows=32) as writer:
        writer.event(Event(0.0, "note", "begin"))
        for _ in range(40):
            n_rows = int(rng.choice([1, 5, 20, 100]))
            writer.append(values(n_rows, n_samples))
            n_samples += n_rows
            if rng.random() < 0.3:
                torn = disk.cut(rng, next(crash_folders))
                recovery = recover(torn)
                assert recovery.lost == ()
                made = assert_holds(torn, n_samples) if n_samples > 1 else None
                assert recovery.n_samples == n_samples
                assert made is None or (made.title, made.events) == ("rig 4", (Event(0.0, "note", "begin"),))
    assert len(read(path)) == n_samples


def interrupted(path: Path, n_samples: int, **options: int) -> None:
    """A recording whose writer vanished: both files are as it left them."""
    writer = RecordingWriter(path, SPECS, **options)
    for first in range(0, n_samples, BATCH):
        writer.append(values(min(BATCH, n_samples - first), first))
    data, journal = path.read_bytes(), journal_of(path).read_bytes()
    writer.close()
    path.write_bytes(data)
    journal_of(path).write_bytes(journal)


@pytest.mark.parametrize("kept", [0, 100, 3000, 30_000])
def test_a_truncated_file_gets_its_tail_back_and_says_what_is_lost(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "run.h5"
    interrupted(path, 100_000, chunk_rows=1024)
    path.write_bytes(path.read_bytes()[:kept])
    recovery = recover(path)
    made = read(path)
    assert len(made) == recovery.n_samples < 100_000
    np.testing.assert_array_equal(made["force"].values[-600:], np.arange(99_400, 100_000))
    row, kept_position = made.time / ROW_S, ~np.isnan(made["position"].values)
    np.testing.assert_array_equal(made["position"].values[kept_position], np.sin(np.rint(row))[kept_position])
    assert recovery.lost
    assert "are lost, the disk did not keep them" in recovery.lost[0]
    assert {event.kind for event in made.events} == {"gap"}
    assert path.with_name("run.h5.damaged").stat().st_size == kept


def test_a_lost_chunk_of_one_signal_is_missing_and_not_invented(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    interrupted(path, 100_000, chunk_rows=1024)
    with h5py.File(path, "r") as file:
        place = file["signals/position"].id.get_chunk_info_by_coord((2048,)).byte_offset
    data = bytearray(path.read_bytes())
    data[place + 5] ^= 0xFF
    path.write_bytes(data)
    recovery = recover(path)
    assert recovery.lost == ("position: samples 2048 to 3071 are lost, the disk did not keep them",)
    made = read(path)
    missing = np.isnan(made["position"].values)
    assert missing[2048:3072].all()
    assert missing.sum() == 1024
    np.testing.assert_array_equal(made["force"].values, np.arange(100_000))


def test_without_the_file_the_journal_alone_gives_the_tail(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    interrupted(path, 500)
    path.unlink()
    assert recover(path).n_samples == 500
    assert_holds(path, 500)


def test_a_recovery_cut_short_can_be_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.h5"
    interrupted(path, 1000, chunk_rows=64)

    def power_cut(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    for owner, name in ((os, "fsync"), (Path, "replace"), (Path, "unlink")):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, power_cut)
            with pytest.raises(KeyboardInterrupt):
                recover(path)
        assert journal_of(path).exists()
    assert recover(path).n_samples == 1000
    assert recover(path).merged is False
    assert_holds(path, 1000)


def test_a_journal_left_behind_by_a_clean_end_is_only_removed(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    writer = RecordingWriter(path, SPECS)
    writer.append(values(10))
    journal = journal_of(path).read_bytes()
    writer.close()
    before = path.read_bytes()
    journal_of(path).write_bytes(journal)
    recovery = recover(path)
    assert (recovery.merged, recovery.n_samples) == (False, 10)
    assert recover(path) == recovery
    assert path.read_bytes() == before
    assert not journal_of(path).exists()


@pytest.mark.parametrize("data", [b"", b"bristle journal 1\n", b"something else entirely", b"\0" * 100])
def test_a_journal_that_is_none_is_refused_unless_the_file_says_it_all(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "run.h5"
    interrupted(path, 50)
    journal_of(path).write_bytes(data)
    whole = path.read_bytes()
    path.write_bytes(whole[:700])
    with pytest.raises(BadInput, match=r"run.h5.journal: the journal is damaged from its start; delete it if"):
        recover(path)
    assert path.exists()
    path.write_bytes(whole)
    assert recover(path).n_samples == 50
    assert_holds(path, 50)


def test_a_living_recording_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with RecordingWriter(path, SPECS) as writer:
        writer.append(values(10))
        with pytest.raises(BadInput, match="it is still being recorded; stop the recorder first"):
            recover(path)
        with pytest.raises(BadInput, match="another process is recording into it"):
            RecordingWriter(path, SPECS, overwrite=True)
        writer.append(values(10, 10))
    assert_holds(path, 20)


def test_nothing_to_recover_and_nothing_there(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="there is no such file"):
        recover(tmp_path / "nowhere.h5")


def test_a_recording_without_one_number_is_put_right_too(tmp_path: Path) -> None:
    """A map that does not fit the device: all that there is to keep is why."""
    path = tmp_path / "run.h5"
    writer = RecordingWriter(path, SPECS)
    writer.append(values(10) | {"position": np.full(10, np.nan)})
    writer.event(Event(0.0, "bad_value", "position: not valid: exception 2"))
    data, journal = path.read_bytes(), journal_of(path).read_bytes()
    writer.close()
    path.write_bytes(data)
    journal_of(path).write_bytes(journal)
    assert recover(path).n_samples == 10
    assert "every sample of position is missing" in describe(path)
    assert "exception 2" in describe(path)
