"""The journal of a recording that is being written: what a power cut must not take.

A flush of HDF5 survives a killed process but not a power cut, and a process killed in the middle of a flush can leave
a file whose columns differ in length. So every batch goes into a small file beside the recording first, is forced onto
the disk, and only then into HDF5. The journal is a row of frames, each with its length and checksum, so that a torn
last frame is recognised:

    head    run id, rows a chunk, and the header of the recording: all that is needed to build the file again
    event   one event
    chunk   a full chunk of every column is on the disk: at which byte of the HDF5 file, with which checksum
    rows    a batch: the number of its first row, then its values, column by column

Chunks of the HDF5 file are stored uncompressed and never move once full. A recovery therefore takes them from their
bytes and the rest from the `rows` frames, and trusts nothing else in a file that may be torn. When chunks are on the
disk their rows leave the journal, which so stays about a megabyte beside sixteen bytes a chunk and column.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from recordings.arrays import Array
from recordings.atomic_files import appearing
from recordings.errors import BadInput
from recordings.hdf5.columns import StoredColumn, columns_of
from recordings.hdf5.disk import check_same
from recordings.hdf5.header import Header
from recordings.hdf5.opening import journal_path
from recordings.plant import Event, Plant
from recordings.signal import SignalSpec

_MAGIC = b"bristle journal 1\n"
_FRAME = struct.Struct("<cII")  # kind, length, checksum
_ROW = struct.Struct("<Q")
_LIMIT_BYTES = 1 << 20
_MOST_CHUNK_ROWS = 1 << 24
_MOST_CHECKED = 64
"""How often its own size a damaged journal is summed over in the search for the next whole frame."""
HEAD, EVENT, CHUNK, ROWS = KINDS = b"H", b"E", b"C", b"R"


@dataclass(frozen=True)
class Chunk:
    """Where one full chunk of every column lies: (byte offset, CRC-32), in the order of `columns_of`."""

    first_row: int
    places: tuple[tuple[int, int], ...]


@dataclass
class Contents:
    """What a journal says. rows : batches as (first row, array of shape (n_columns, n_rows)); a damaged one is missing.

    damaged : whether there were bytes that are no whole frame, be it only a last one that was torn.
    """

    run: str
    chunk_rows: int
    header: Header
    events: list[Event] = field(default_factory=list)
    chunks: list[Chunk] = field(default_factory=list)
    rows: list[tuple[int, Array]] = field(default_factory=list)
    damaged: bool = False

    @cached_property
    def columns(self) -> tuple[StoredColumn, ...]:
        """What each row of an array is."""
        return columns_of(self.header)


class Journal:
    """The writing side. Every method returns when its frame is on the disk, `chunk` excepted.

    path : of the recording; run : what the recording's root attribute `journal` names; chunk_rows : rows a chunk.
    """

    def __init__(self, path: Path, run: str, chunk_rows: int, header: Header) -> None:
        self._path = journal_path(path)
        head = {"run": run, "chunk_rows": chunk_rows} | _plain(header)
        self._file = self._start([_frame(HEAD, json.dumps(head).encode())])
        self._n_kept = self._file.tell()

    @property
    def oversize(self) -> bool:
        """Whether it has outgrown what it must keep, so that `restart` is worth it."""
        return self._file.tell() > 2 * self._n_kept + _LIMIT_BYTES

    def check_in_place(self) -> None:
        """Raise `BadInput` when it was removed, moved or replaced."""
        check_same(self._path, os.fstat(self._file.fileno()))

    def rows(self, first_row: int, columns: Array) -> None:
        """Add a batch, shape (n_columns, n_rows)."""
        self._append(_rows_frame(first_row, columns))
        os.fsync(self._file.fileno())

    def event(self, event: Event) -> None:
        """Add an event."""
        self._keep(_frame(EVENT, json.dumps(asdict(event)).encode()))
        os.fsync(self._file.fileno())

    def chunk(self, chunk: Chunk) -> None:
        """Note that a chunk is on the disk; not forced there, because its rows are still in the journal."""
        self._keep(_frame(CHUNK, json.dumps([chunk.first_row, *chunk.places]).encode()))

    def restart(self, first_row: int, columns: Array) -> None:
        """Forget every batch but the rows behind the last full chunk, shape (n_columns, n_rows)."""
        data = self._path.read_bytes()[len(_MAGIC) :]  # not held in memory: a long run has many events
        kept = [_frame(*frame) for frame in _frames(data) if frame[0] != ROWS]
        self._n_kept = len(_MAGIC) + sum(map(len, kept))
        old, self._file = self._file, self._start([*kept, _rows_frame(first_row, columns)])
        old.close()

    def remove(self) -> None:
        """Delete it: the recording is complete without it."""
        self.close()
        self._path.unlink()

    def close(self) -> None:
        """Stop writing and leave it where it is."""
        self._file.close()

    def _start(self, frames: list[bytes]) -> BinaryIO:
        with appearing(self._path) as draft:
            draft.write_bytes(_MAGIC + b"".join(frames))
        return self._path.open("ab", buffering=0)

    def _keep(self, frame: bytes) -> None:
        self._append(frame)
        self._n_kept += len(frame)

    def _append(self, frame: bytes) -> None:
        left = memoryview(frame)
        while left:
            left = left[self._file.write(left) :]


def read_journal(path: Path) -> Contents:
    """What the journal of a recording says: every frame that is whole, also behind a damaged one.

    Raises
    ------
    BadInput
        It is no journal, its head is damaged, or what it says cannot be.
    """
    where = journal_path(path)
    data = where.read_bytes()
    frames = _frames(data[len(_MAGIC) :]) if data.startswith(_MAGIC) else iter(())
    try:
        kind, head = next(frames)
        if kind != HEAD:
            raise ValueError("the head is damaged")
        contents = _contents(json.loads(head))
        n_bytes = len(_MAGIC) + _FRAME.size + len(head)
        for kind, payload in frames:
            _take(contents, kind, payload)
            n_bytes += _FRAME.size + len(payload)
        contents.damaged = n_bytes != len(data)
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError, RecursionError, struct.error) as error:
        raise _damaged(where) from error
    except StopIteration as error:
        raise _damaged(where) from error
    return contents


def _damaged(where: Path) -> BadInput:
    remedy = "delete it if the recording beside it can be read without"
    return BadInput(str(where), "the journal is damaged from its start", remedy)


def _take(contents: Contents, kind: bytes, payload: bytes) -> None:
    if kind == EVENT:
        contents.events.append(Event(**json.loads(payload)))
    elif kind == CHUNK:
        first_row, *places = json.loads(payload)
        contents.chunks.append(Chunk(_whole(first_row), tuple((_whole(offset), _whole(crc)) for offset, crc in places)))
        if len(places) != len(contents.columns):
            raise ValueError("a chunk has other columns than the head")
    elif kind == ROWS:
        (first_row,) = _ROW.unpack_from(payload)
        columns = np.frombuffer(payload, "<f8", offset=_ROW.size)
        contents.rows.append((_whole(first_row), columns.reshape(len(contents.columns), -1)))


def _whole(number: Any, most: int = (1 << 62) - 1) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= most:
        raise ValueError(f"{number} is no place in a file")
    return number


def _rows_frame(first_row: int, columns: Array) -> bytes:
    return _frame(ROWS, _ROW.pack(first_row) + columns.astype("<f8").tobytes())


def _frame(kind: bytes, payload: bytes) -> bytes:
    return _FRAME.pack(kind, len(payload), zlib.crc32(kind + payload)) + payload


def _frames(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The frames that are whole. A damaged one is passed over; a torn last one was never acknowledged."""
    place, budget = 0, _MOST_CHECKED * len(data)
    while place + _FRAME.size <= len(data) and budget > 0:
        kind, length, checksum = _FRAME.unpack_from(data, place)
        end = place + _FRAME.size + length
        if kind in KINDS and end <= len(data):
            payload = data[place + _FRAME.size : end]
            budget -= length
            if zlib.crc32(kind + payload) == checksum:
                yield kind, payload
                place, budget = end, budget + length
                continue
        place += 1


def _plain(header: Header) -> dict[str, Any]:
    """A header as JSON can hold it."""
    return {
        "signals": [asdict(spec) for spec in header.signals],
        "plant": header.plant.known(),
        "title": header.title,
        "source": header.source,
        "created": header.created.isoformat() if header.created else None,
        "attributes": dict(header.attributes),
        "per_value": header.per_value,
    }


def _contents(head: dict[str, Any]) -> Contents:
    header = Header(
        signals=tuple(SignalSpec(**spec) for spec in head["signals"]),
        plant=Plant(**head["plant"]),
        title=head["title"],
        source=head["source"],
        created=datetime.fromisoformat(head["created"]) if head["created"] else None,
        attributes=head["attributes"],
        per_value=bool(head.get("per_value", False)),  # journals of earlier versions do not have it
    )
    if not isinstance(head["run"], str):
        raise TypeError("the run has no name")
    return Contents(head["run"], max(_whole(head["chunk_rows"], _MOST_CHUNK_ROWS), 1), header)
