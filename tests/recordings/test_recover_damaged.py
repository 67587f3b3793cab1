"""Recovery when the disk damaged one of the two files: whichever is whole brings every acknowledged sample back.

The long run harms every byte and every block of both files of a smaller recording, and prints how many there were.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import numpy as np
import pytest
from dying_writer import values
from recording_samples import SPECS

from bristle.cli.app import run
from recordings import BadInput, Event, Recording, RecordingWriter, Recovery, SignalSpec, read, recover
from recordings.hdf5 import probe

EVENTS = (Event(0.5, "note", "begins"), Event(1.0, "gap", "pump off"))
MOST_WRONG = 20
STRIDE = 1999
"""Every so manieth byte is flipped by default, every byte in the long run. Prime, so that all columns are met."""


@pytest.fixture(autouse=True)
def _no_waiting_for_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of recoveries, none of which ends in a power cut."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


@dataclass(frozen=True)
class CutOff:
    """The bytes of a recording that was cut off, and of its journal. specs : its signals; n_samples : acknowledged;
    right : recovered files that were found right; most are the same bytes again.
    """

    file: bytes
    journal: bytes
    specs: Sequence[SignalSpec]
    n_samples: int
    right: set[bytes] = field(default_factory=set)


def cut_off_in(folder: Path, specs: Sequence[SignalSpec], n_samples: int, chunk_rows: int) -> CutOff:
    path, batch = folder / "run.h5", n_samples // 5
    names = [spec.name for spec in specs]
    with RecordingWriter(path, specs, chunk_rows=chunk_rows, title="small", per_value=True) as writer:
        for start in range(0, n_samples, batch):
            told = (of(names[1:], one) for one in details(batch, start))
            writer.append(of(names, values(batch, start)), *told)
        for event in EVENTS:
            writer.event(event)
        return CutOff(path.read_bytes(), journal_of(path).read_bytes(), specs, n_samples)


def of(names: Sequence[str], columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: columns[name] for name in names}


@pytest.fixture(scope="module")
def cut_off(tmp_path_factory: pytest.TempPathFactory) -> CutOff:
    return cut_off_in(tmp_path_factory.mktemp("cut"), SPECS, 150, 32)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> CutOff:
    """One signal beside the clock, and some whole chunks."""
    return cut_off_in(tmp_path_factory.mktemp("small"), SPECS[:2], 50, 16)


def details(n_samples: int, start: int = 0) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The quality and the reply times of the samples from `start` on."""
    row = np.arange(start, start + n_samples)
    names = ("position", "force")
    return dict.fromkeys(names, row % 5.0), {name: np.where(row % 5, np.nan, 0.001 * row) for name in names}


def journal_of(path: Path) -> Path:
    return path.with_name(path.name + ".journal")


def flipped(data: bytes, stride: int) -> Iterator[bytes]:
    random = Random(stride)
    for place in range(0, len(data), stride):
        changed = bytearray(data)
        changed[place] ^= random.randrange(1, 256)
        yield bytes(changed)


def torn(data: bytes, size: int) -> Iterator[bytes]:
    """Each block in turn as a disk leaves it that lost it: zeros, or what was there before."""
    for place in range(0, len(data), size):
        for filling in (bytes(size), bytes(range(256)) * (size // 256)):
            yield (data[:place] + filling + data[place + size :])[: len(data)]


def missing(path: Path, made_of: CutOff, file: bytes, journal: bytes) -> str:
    """What is wrong with the recovery of the two; empty when nothing is. What the journal has handed over to the file
    is checked there: a chunk of it that is damaged is a gap with an event, never a wrong value.
    """
    path.write_bytes(file)
    journal_of(path).write_bytes(journal)
    try:
        recovery = recover(path)
        if not recovery.lost and path.read_bytes() in made_of.right:
            return ""
        found = difference(read(path), recovery, made_of)
    except Exception as error:
        return f"{error!r:.300}"
    if not found:
        made_of.right.add(path.read_bytes())
    return found


def difference(made: Recording, recovery: Recovery, made_of: CutOff) -> str:
    """What a recovered recording says differently; empty for nothing."""
    names, n_samples = [spec.name for spec in made_of.specs], made_of.n_samples
    for name, expected in of(names, values(n_samples)).items():
        if len(made) != n_samples or not np.array_equal(made[name].values, expected):
            return f"{name}: {len(made)} samples, {recovery}"
    for kept, told in zip((made.quality, made.reply_times), details(n_samples), strict=True):
        for name, expected in of(names[1:], told).items():
            if not np.array_equal(kept[name], expected, equal_nan=True):
                return f"what is known of {name}, {recovery}"
    if not recovery.lost and sorted(made.events, key=lambda event: event.time) != list(EVENTS):
        return f"events: {made.events}"
    return "lost" if recovery.lost else ""


def check_damaged(cut_off: CutOff, folder: Path, of_file: Iterator[bytes], of_journal: Iterator[bytes]) -> int:
    """Every damaged file beside a whole journal, and every damaged journal beside a whole file; how many there were."""
    path, n_cases = folder / "run.h5", 0
    wrong: list[tuple[int, str]] = []
    for damaged in of_file:
        wrong += [(n_cases, found)] if (found := missing(path, cut_off, damaged, cut_off.journal)) else []
        n_cases += 1
        assert len(wrong) < MOST_WRONG, wrong
    for damaged in of_journal:
        wrong += [(n_cases, found)] if (found := missing(path, cut_off, cut_off.file, damaged)) else []
        n_cases += 1
        assert len(wrong) < MOST_WRONG, wrong
    assert wrong == []
    return n_cases


@pytest.mark.slow
def test_a_flipped_byte_of_either_file_loses_nothing(cut_off, tmp_path):
    files, journals = flipped(cut_off.file, STRIDE), flipped(cut_off.journal, STRIDE // 8)
    assert check_damaged(cut_off, tmp_path, files, journals) > 18


@pytest.mark.parametrize("size", [16384, pytest.param(4096, marks=pytest.mark.slow)])
def test_a_torn_block_of_either_file_loses_nothing(cut_off, tmp_path, size):
    assert check_damaged(cut_off, tmp_path, torn(cut_off.file, size), torn(cut_off.journal, size)) > 40960 // size


@pytest.mark.long
@pytest.mark.parametrize("size", [512, 4096])
def test_every_torn_block_of_either_file_loses_nothing(cut_off, small, tmp_path, size):
    for one in (cut_off, small):
        n_cases = check_damaged(one, tmp_path, torn(one.file, size), torn(one.journal, size))
        print(f"{n_cases} torn blocks of {size} B: nothing lost")


# Every byte: so many recoveries need a short way, with one child process for thousands of them

LONGEST_S, MOST_MEMORY = 5.0, 2 << 30
"""Processor time of one case, and memory of the child."""


def with_a_flip(made_of: CutOff, place: int) -> tuple[bytes, bytes]:
    """File and journal with one byte changed. Places behind the end of the file are in the journal."""
    both = bytearray(made_of.file + made_of.journal)
    both[place] ^= Random(place).randrange(1, 256)
    return bytes(both[: len(made_of.file)]), bytes(both[len(made_of.file) :])


def doubtful(made_of: CutOff, folder: Path, places: Sequence[int]) -> list[int]:
    """The flips that are not found right when no file is tried in a process of its own first."""
    left, found = list(places), list[int]()
    while left:
        verdicts = short_way(made_of, folder / "run.h5", left)
        found += [place for place, right in zip(left, verdicts, strict=False) if not right]
        found += left[len(verdicts) : len(verdicts) + 1]  # the child did not survive it
        left = left[len(verdicts) + 1 :]
    return found


def short_way(made_of: CutOff, path: Path, places: Sequence[int]) -> bytes:
    """A byte for each of the flips, 1 for right, up to one that crashes the HDF5 library, never ends or takes all the
    memory.
    """
    inside, outside = os.pipe()
    child = os.fork()
    if child == 0:
        probe._CAN_TRY = False
        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        for place in places:
            signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
            os.write(outside, bytes([not missing(path, made_of, *with_a_flip(made_of, place))]))
        os._exit(0)
    os.close(outside)
    with open(inside, "rb") as verdicts:
        found = verdicts.read()
    os.waitpid(child, 0)
    return found


@pytest.mark.long
@pytest.mark.parametrize("part", range(16))
def test_every_flipped_byte_of_either_file_loses_nothing(small, tmp_path, part):
    """In parts, so that the work can be shared out. Whatever is doubtful is done again as a user would."""
    places = range(part, len(small.file) + len(small.journal), 16)
    again = doubtful(small, tmp_path, places)
    wrong = [(place, missing(tmp_path / "run.h5", small, *with_a_flip(small, place))) for place in again]
    assert [one for one in wrong if one[1]] == []
    print(f"{len(places)} flipped bytes, {len(again)} of them done again: nothing lost")


@pytest.mark.parametrize("stride", [997, pytest.param(197, marks=pytest.mark.slow)])
def test_a_journal_cut_off_anywhere_loses_nothing(cut_off, tmp_path, stride):
    for length in range(0, len(cut_off.journal), stride):
        assert missing(tmp_path / "run.h5", cut_off, cut_off.file, cut_off.journal[:length]) == "", f"{length} bytes"


# Journals that somebody made up


def frame(kind: bytes, payload: bytes) -> bytes:
    return struct.pack("<cII", kind, len(payload), zlib.crc32(kind + payload)) + payload


def head_of(journal: bytes) -> dict[str, object]:
    start = len(b"bristle journal 1\n")
    (length,) = struct.unpack_from("<I", journal, start + 1)
    return json.loads(journal[start + 9 : start + 9 + length])


HOSTILE_HEADS: dict[str, Callable[[dict[str, object]], object]] = {
    "deep": lambda head: None,
    "a list": lambda head: [head],
    "huge chunks": lambda head: head | {"chunk_rows": 10**15},
    "negative chunks": lambda head: head | {"chunk_rows": -4},
    "chunks in words": lambda head: head | {"chunk_rows": "many"},
    "run is a number": lambda head: head | {"run": 4},
    "no signals": lambda head: head | {"signals": []},
    "signals are a number": lambda head: head | {"signals": 3},
    "signal of numbers": lambda head: head | {"signals": [1, 2]},
    "unknown key": lambda head: head | {"signals": [{"name": "time", "unit": "s", "role": "time", "x": 1}]},
    "plant is a list": lambda head: head | {"plant": [1]},
    "attributes are a number": lambda head: head | {"attributes": 7},
    "created is a number": lambda head: head | {"created": 7},
    "created is a word": lambda head: head | {"created": "yesterday"},
    "large number": lambda head: head | {"attributes": {"a": 10**4000}},
}
HOSTILE_FRAMES = {
    "deep event": frame(b"E", b"[" * 100_000),
    "event is a number": frame(b"E", b"3"),
    "event without text": frame(b"E", b'{"time": 1}'),
    "event at no time": frame(b"E", b'{"time": NaN, "kind": "a", "text": "b"}'),
    "chunk is a number": frame(b"C", b"3"),
    "chunk nowhere": frame(b"C", json.dumps([0, [-5, 1], *[[0, 1]] * 6]).encode()),
    "chunk of one signal": frame(b"C", b"[0, [5, 1]]"),
    "chunk beyond all": frame(b"C", json.dumps([0, [1e300, 1], *[[0, 1]] * 6]).encode()),
    "chunk in words": frame(b"C", json.dumps(["a", *[[0, 1]] * 7]).encode()),
    "rows without a number": frame(b"R", b"123"),
    "rows that do not divide": frame(b"R", bytes(8 + 8 * 4)),
    "rows far away": frame(b"R", struct.pack("<Q", 1 << 63) + bytes(8 * 7)),
    "time goes backwards": frame(b"R", struct.pack("<Q", 150) + struct.pack("<14d", -1, -2, *[0] * 12)),
}


@pytest.mark.parametrize("what", [*HOSTILE_HEADS, *HOSTILE_FRAMES])
def test_a_made_up_journal_is_one_line_and_leaves_nothing_behind(cut_off, tmp_path, capsys, what):
    journal = cut_off.journal
    path, target = tmp_path / "run.h5", tmp_path / "out.h5"
    path.write_bytes(bytes(1000))
    magic = b"bristle journal 1\n"
    if what in HOSTILE_HEADS:
        payload = b"[" * 100_000 if what == "deep" else json.dumps(HOSTILE_HEADS[what](head_of(journal))).encode()
        journal_of(path).write_bytes(magic + frame(b"H", payload))
    else:
        journal_of(path).write_bytes(journal + HOSTILE_FRAMES[what])
    assert run(["import", str(path), "--to", str(target)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not target.exists()
    assert sorted(tmp_path.iterdir()) == [path, journal_of(path)]


def test_rows_that_neither_of_the_two_has_are_a_gap_and_said(cut_off, tmp_path):
    """A stretch of the journal is gone, and the file with it: what is left is exact, and the loss has an event."""
    journal = cut_off.journal
    path = tmp_path / "run.h5"
    place = journal.index(b"R", 1500)
    journal_of(path).write_bytes(journal[:place] + bytes(40) + journal[place + 40 :])
    recovery = recover(path)
    made, expected = read(path), values(cut_off.n_samples)
    assert recovery.lost
    assert any(event.kind == "gap" and "are lost" in event.text for event in made.events)
    kept = np.isin(expected["time"], made["time"].values)
    assert np.array_equal(made["position"].values, expected["position"][kept], equal_nan=True)
    with pytest.raises(BadInput):
        recover(tmp_path / "nothing.h5")
