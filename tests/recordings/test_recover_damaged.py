"""Recovery when the disk damaged one of the two files: whichever is whole brings every acknowledged sample back."""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import numpy as np
import pytest
from dying_writer import values
from recording_samples import SPECS

from bristle.cli.app import run
from recordings import BadInput, Event, RecordingWriter, read, recover

N_SAMPLES, CHUNK_ROWS = 150, 32
EVENTS = (Event(0.5, "note", "begins"), Event(1.0, "gap", "pump off"))
STRIDE = 1999
"""Every so manieth byte is flipped by default, every byte in the long run. Prime, so that all columns are met."""


@pytest.fixture(autouse=True)
def _no_waiting_for_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of recoveries, none of which ends in a power cut."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


@pytest.fixture(scope="module")
def cut_off(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    """The bytes of a recording that was cut off, and of its journal."""
    path = tmp_path_factory.mktemp("cut") / "run.h5"
    writer = RecordingWriter(path, SPECS, chunk_rows=CHUNK_ROWS, title="small", per_value=True)
    for start in range(0, N_SAMPLES, 30):
        writer.append(values(30, start), *details(30, start))
    for event in EVENTS:
        writer.event(event)
    found = path.read_bytes(), journal_of(path).read_bytes()
    writer.close()
    return found


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


def missing(path: Path, file: bytes, journal: bytes) -> str:
    """What is wrong with the recovery of the two; empty when nothing is."""
    path.write_bytes(file)
    journal_of(path).write_bytes(journal)
    recovery = recover(path)
    made = read(path)
    for name, expected in values(N_SAMPLES).items():
        if len(made) != N_SAMPLES or not np.array_equal(made[name].values, expected):
            return f"{name}: {len(made)} samples, {recovery}"
    for kept, told in zip((made.quality, made.reply_times), details(N_SAMPLES), strict=True):
        for name, expected in told.items():
            if not np.array_equal(kept[name], expected, equal_nan=True):
                return f"what is known of {name}, {recovery}"
    if not recovery.lost and sorted(made.events, key=lambda event: event.time) != list(EVENTS):
        return f"events: {made.events}"
    return "lost" if recovery.lost else ""


def check_damaged_file(cut_off: tuple[bytes, bytes], folder: Path, cases: Iterator[bytes]) -> int:
    """Every damaged file beside a whole journal. What the journal has handed over to the file is checked there: a chunk
    of it that is damaged is a gap with an event, never a wrong value.
    """
    _, journal = cut_off
    n_cases = 0
    for n_cases, damaged in enumerate(cases, 1):
        assert missing(folder / "run.h5", damaged, journal) == "", f"case {n_cases}"
    return n_cases


def check_damaged_journal(cut_off: tuple[bytes, bytes], folder: Path, cases: Iterator[bytes]) -> int:
    file, _ = cut_off
    n_cases = 0
    for n_cases, damaged in enumerate(cases, 1):
        assert missing(folder / "run.h5", file, damaged) == "", f"case {n_cases}"
    return n_cases


def test_a_flipped_byte_of_the_file_loses_nothing(cut_off, tmp_path):
    assert check_damaged_file(cut_off, tmp_path, flipped(cut_off[0], STRIDE)) > 8


@pytest.mark.parametrize("stride", [STRIDE // 4, pytest.param(STRIDE // 8, marks=pytest.mark.slow)])
def test_a_flipped_byte_of_the_journal_loses_nothing(cut_off, tmp_path, stride):
    assert check_damaged_journal(cut_off, tmp_path, flipped(cut_off[1], stride)) > 10


@pytest.mark.parametrize(
    "size", [16384, pytest.param(4096, marks=pytest.mark.slow), pytest.param(512, marks=pytest.mark.long)]
)
def test_a_torn_block_of_either_file_loses_nothing(cut_off, tmp_path, size):
    check_damaged_file(cut_off, tmp_path, torn(cut_off[0], size))
    check_damaged_journal(cut_off, tmp_path, torn(cut_off[1], size))


@pytest.mark.long
def test_every_flipped_byte_of_either_file_loses_nothing(cut_off, tmp_path):
    assert check_damaged_file(cut_off, tmp_path, flipped(cut_off[0], 1)) == len(cut_off[0])
    assert check_damaged_journal(cut_off, tmp_path, flipped(cut_off[1], 1)) == len(cut_off[1])


@pytest.mark.parametrize("stride", [997, pytest.param(197, marks=pytest.mark.slow)])
def test_a_journal_cut_off_anywhere_loses_nothing(cut_off, tmp_path, stride):
    file, journal = cut_off
    for length in range(0, len(journal), stride):
        assert missing(tmp_path / "run.h5", file, journal[:length]) == "", f"{length} bytes"


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
    _, journal = cut_off
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
    _, journal = cut_off
    path = tmp_path / "run.h5"
    place = journal.index(b"R", 1500)
    journal_of(path).write_bytes(journal[:place] + bytes(40) + journal[place + 40 :])
    recovery = recover(path)
    made, expected = read(path), values(N_SAMPLES)
    assert recovery.lost
    assert any(event.kind == "gap" and "are lost" in event.text for event in made.events)
    kept = np.isin(expected["time"], made["time"].values)
    assert np.array_equal(made["position"].values, expected["position"][kept], equal_nan=True)
    with pytest.raises(BadInput):
        recover(tmp_path / "nothing.h5")
