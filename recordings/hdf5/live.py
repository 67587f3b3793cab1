"""Writing a recording while it happens, so that nothing acknowledged is lost to a killed process or a power cut."""

from __future__ import annotations

import secrets
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from types import TracebackType

import h5py
import numpy as np
from numpy.typing import ArrayLike

from recordings.arrays import Array
from recordings.atomic_files import sync, writing
from recordings.errors import BadInput
from recordings.hdf5.columns import columns_of
from recordings.hdf5.disk import Disk, undisturbed
from recordings.hdf5.header import Header, Origin
from recordings.hdf5.journal import Chunk, Journal
from recordings.hdf5.layout_writer import append_events, append_samples, create_columns, create_events, write_header
from recordings.hdf5.opening import check_vacant, journal_path
from recordings.hdf5.problems import h5py_errors, hdf5_refusals
from recordings.hdf5.recover import recover
from recordings.plant import Event, Plant
from recordings.sample_checks import TIME_REMEDY, codes_problem, time_fault
from recordings.signal import SignalSpec

CHUNK_ROWS = 4096
MOST_HELD = 512
"""Rows that may wait in the journal alone: more save little, and take memory."""
_CACHE_BYTES, _CACHE_BYTES_A_COLUMN = 1 << 16, 3 << 10
"""Of the file's structure: for the end of each column's index, and its header."""


class RecordingWriter:
    """A recording in the making, one file a run; a context manager.

    When `append` or `event` returns, what it was given survives the death of the process and a power cut: it is in the
    journal beside the file, on the disk, and flushed into the HDF5 file, which other processes may read at any time
    (with `hold` it comes there a little later).
    After either accident `recover` puts the file right. `close` removes the journal.

    Parameters
    ----------
    path : str or Path
        The file to make.
    signals : sequence of SignalSpec
        What will be recorded, exactly one of them `time`.
    plant, title, source, attributes
        As in `Recording`.
    created : datetime, optional
        When the recording began, with time zone; now when not given.
    overwrite : bool
        Whether a file that exists is replaced; refused otherwise.
    per_value : bool
        Whether the quality and the reply time of each value are kept: recording format version 2.
    chunk_rows : int
        Rows after which the HDF5 file itself is forced onto the disk.
    hold : float
        How long samples may wait in the journal alone, by the recording's own clock and in its unit, and `MOST_HELD`
        rows at most: the HDF5 file costs by the write, and the journal next to nothing.

    Raises
    ------
    BadInput
        The file exists, the disk refuses, or the signals do not make a recording.

    >>> import tempfile
    >>> from recordings import read
    >>> path = Path(tempfile.mkdtemp()) / "run.h5"
    >>> specs = [SignalSpec("time", "s", "time"), SignalSpec("position", "mm", "output")]
    >>> with RecordingWriter(path, specs) as writer:
    ...     writer.append({"time": [0.0, 0.1], "position": [4.0, 4.1]})
    ...     writer.append({"time": 0.2, "position": 4.2})
    >>> read(path)["position"].values
    array([4. , 4.1, 4.2])
    """

    def __init__(
        self,
        path: str | Path,
        signals: Sequence[SignalSpec],
        *,
        plant: Plant | None = None,
        title: str | None = None,
        source: Origin | None = None,
        created: datetime | None = None,
        attributes: Mapping[str, str | float] | None = None,
        overwrite: bool = False,
        per_value: bool = False,
        chunk_rows: int = CHUNK_ROWS,
        hold: float = 0.0,
    ) -> None:
        self.path = Path(path)
        about = (plant or Plant(), title, source, created or datetime.now(UTC), attributes or {})
        header = Header(tuple(signals), *about, per_value=per_value)
        self._names = [spec.name for spec in header.signals]
        self._columns = columns_of(header)
        self._n_rows, self._last_time, self._n_chunks, self._chunk_rows = 0, -np.inf, 0, chunk_rows
        self._hold, self._held = hold, list[Array]()  # batches (n_columns, n_rows) that only the journal has
        self._stored_until = -np.inf
        self._run, self._failed, self._closed = secrets.token_hex(8), False, False
        self._checksums: list[int] = []  # of each full chunk: over those of its columns
        with writing(self.path), undisturbed(), hdf5_refusals(self.path):
            check_vacant(self.path, overwrite, "a run makes a new file: choose another name")
            if overwrite:  # else somebody may begin to record there just now
                self.path.unlink(missing_ok=True)
                journal_path(self.path).unlink(missing_ok=True)
            self._disk = Disk(self.path)
            try:
                self._file = self._create(header)
                self._datasets = [self._file[column.group][column.name] for column in self._columns]
                self._disk.sync()
                sync(self.path.parent)
                self._journal = Journal(self.path, self._run, chunk_rows, header)
            except BaseException:
                with suppress(AttributeError):  # it was not made
                    self._file.close()
                self.path.unlink()
                self._disk.close()
                raise

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            self.close()
        except BadInput:
            if error is None:  # the first error is the one to show
                raise

    def __len__(self) -> int:
        """The number of samples acknowledged."""
        return self._n_rows

    @property
    def n_bytes(self) -> int:
        """The size of the file, also where somebody took it away."""
        return self._disk.n_bytes

    def append(
        self,
        batch: Mapping[str, ArrayLike],
        quality: Mapping[str, ArrayLike] | None = None,
        reply_times: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Add samples; when it returns they are safe.

        Parameters
        ----------
        batch : mapping of str to array_like
            For every signal its values, shape (n_rows,), or one number for one row; missing samples are NaN.
        quality, reply_times : mapping of str to array_like
            The same for every signal but time, where the recording keeps them: codes of `QUALITIES`, and the time of
            the reply that brought the value [s], on the clock of the recording; NaN where none came.

        Raises
        ------
        BadInput
            The batch does not fit the signals or its clock does not go forward (nothing is written, go on with the
            next), or the disk refused (close the writer: what was acknowledged stays).
        """
        self._check_open()
        columns = self._checked(batch, quality or {}, reply_times or {})
        with self._acknowledging():
            self._check_files()  # before writing makes a shortened file long again
            self._journal.rows(self._n_rows, columns)
            self._held.append(columns)
            self._n_rows += columns.shape[1]
            self._last_time = float(columns[self._names.index("time"), -1])
            if self._last_time - self._stored_until >= self._hold or sum(map(_length, self._held)) >= MOST_HELD:
                self._store()
            self._check_files()
            if self._n_rows // self._chunk_rows > self._n_chunks:
                self._store()
                self._checkpoint()

    def event(self, event: Event) -> None:
        """Add an event; when it returns it is safe. Raises `BadInput` when the disk refused."""
        self._check_open()
        with self._acknowledging():
            self._journal.event(event)
            append_events(self._file, [event])
            self._file.flush()
            self._check_files()

    def close(self) -> None:
        """Finish the file, read it back, and remove the journal; a second call does nothing.

        After a failed or interrupted write, or where the file does not hold what was acknowledged, it is put right from
        the journal first. Raises `BadInput` when that is impossible now (a full disk); the journal then stays for
        `recover`.
        """
        if self._closed:
            return
        self._closed = True
        with writing(self.path):
            try:
                with undisturbed(), hdf5_refusals(self.path):
                    self._finish()
                    if self._failed and journal_path(self.path).exists():
                        self._disk.put_back(self.path)
            finally:
                self._disk.close()
        if self._failed:
            lost = recover(self.path).lost
            if lost:
                raise BadInput(str(self.path), "; ".join(lost), "what is left of it is in the file")

    def _store(self) -> None:
        """Put what is held into the HDF5 file."""
        if not self._held:
            return
        held, self._held = np.concatenate(self._held, axis=1), []
        for column, dataset, values in zip(self._columns, self._datasets, held, strict=True):
            append_samples(dataset, column.stored(values))
        self._file.flush()
        self._disk.check()
        self._stored_until = self._last_time

    def _finish(self) -> None:
        if self._held and not self._failed:
            try:
                self._check_files()
                self._store()
            except (BadInput, OSError):
                self._failed = True
        if self._failed:
            self._journal.close()
            with suppress(BadInput), h5py_errors(str(self.path)):  # it is made anew from the journal
                self._file.close()
            return
        self._disk.sync()
        end = [dataset[self._n_chunks * self._chunk_rows :].tobytes() for dataset in self._datasets]
        self._checksums.append(_sum(map(zlib.crc32, end)))
        self._file.attrs["journal"] = f"closed {self._run}"
        self._file.close()
        self._disk.sync()
        if self._holds_everything():
            self._journal.remove()
            sync(self.path.parent)
        else:
            self._failed = True
            self._journal.close()

    def _holds_everything(self) -> bool:
        """Whether the closed file, read back by its name, has every sample that was acknowledged."""
        try:
            self._check_files()
            with h5py_errors(str(self.path)), h5py.File(self.path, "r", locking=False, rdcc_nbytes=0) as file:
                _hold_little(file, len(self._columns))
                datasets = [file[column.group][column.name] for column in self._columns]
                return all(len(dataset) == self._n_rows for dataset in datasets) and all(
                    checksum == _sum(zlib.crc32(one[start : start + self._chunk_rows].tobytes()) for one in datasets)
                    for start, checksum in zip(count(0, self._chunk_rows), self._checksums, strict=False)
                )
        except BadInput:
            return False

    def _check_files(self) -> None:
        """Raise what went wrong with either file, be it that somebody took it away."""
        self._disk.check()
        self._disk.check_in_place(self.path)
        self._journal.check_in_place()

    def _create(self, header: Header) -> h5py.File:
        file = h5py.File(self._disk, "w", track_order=True, rdcc_nbytes=0)  # a cache would grow with every signal
        _hold_little(file, len(self._columns))
        write_header(file, header)
        file.attrs["journal"] = f"open {self._run}"
        create_columns(file, header, shape=(0,), maxshape=(None,), chunks=(self._chunk_rows,))
        create_events(file)
        file.flush()
        return file

    def _checked(
        self, batch: Mapping[str, ArrayLike], quality: Mapping[str, ArrayLike], reply_times: Mapping[str, ArrayLike]
    ) -> Array:
        """The batch as one array, shape (n_columns, n_rows)."""
        given = {"signals": batch, "quality": quality, "reply_times": reply_times}
        for group, part in given.items():
            names = [column.name for column in self._columns if column.group == group]
            if set(part) != set(names):
                found = f"a batch has the {group.replace('_', ' ')} {', '.join(part) or 'of nothing'}"
                raise BadInput(str(self.path), found, f"this recording takes exactly {', '.join(names) or 'none'}")
        parts = [np.atleast_1d(np.asarray(given[one.group][one.name], np.float64)) for one in self._columns]
        if any(part.shape != (len(parts[0]),) for part in parts) or not len(parts[0]):
            found = f"a batch has columns of the shapes {', '.join(str(part.shape) for part in parts)}"
            raise BadInput(str(self.path), found, "all have one length of 1 or more")
        fault = time_fault(parts[self._names.index("time")], self._last_time)
        if fault:
            raise BadInput(f"{self.path}: sample {self._n_rows + fault[0]}", fault[1], TIME_REMEDY)
        for column, values in zip(self._columns, parts, strict=True):
            problem = codes_problem(values) if column.group == "quality" else None
            if problem:
                raise BadInput(f"{self.path}: quality of {column.name}", *problem)
        return np.stack(parts)

    def _check_open(self) -> None:
        if self._failed or self._closed:
            found = "an earlier write failed" if self._failed else "it is closed"
            raise BadInput(str(self.path), found, "close it and record into a new file")

    @contextmanager
    def _acknowledging(self) -> Iterator[None]:
        """Whatever stops a write half way leaves the two files apart; only `close` may follow."""
        self._failed = True
        with writing(self.path), undisturbed(), hdf5_refusals(self.path):
            yield
            self._failed = False

    def _checkpoint(self) -> None:
        """Force the full chunks onto the disk, note where they are, and let their rows leave the journal."""
        self._disk.sync()
        rows = self._chunk_rows
        for first_row in range(self._n_chunks * rows, self._n_rows - rows + 1, rows):
            places = tuple(_place(one, first_row, rows) for one in self._datasets)
            self._checksums.append(_sum(checksum for _, checksum in places))
            self._journal.chunk(Chunk(first_row, places))
        self._n_chunks = self._n_rows // rows
        if self._journal.oversize:
            tail = self._n_chunks * rows
            parts = zip(self._columns, self._datasets, strict=True)
            self._journal.restart(tail, np.stack([column.plain(dataset[tail:]) for column, dataset in parts]))


def _hold_little(file: h5py.File, n_columns: int) -> None:
    """Let the library hold no more of the file's structure than it works on: the index of the chunks grows for ever."""
    cache = file.id.get_mdc_config()
    cache.set_initial_size = True
    cache.initial_size = cache.max_size = cache.min_size = max(_CACHE_BYTES, _CACHE_BYTES_A_COLUMN * n_columns)
    file.id.set_mdc_config(cache)


def _length(rows: Array) -> int:
    return rows.shape[1]


def _sum(checksums: Iterable[int]) -> int:
    """One checksum of several: a long run has very many."""
    return zlib.crc32(b"".join(one.to_bytes(4, "little") for one in checksums))


def _place(dataset: h5py.Dataset, first_row: int, n_rows: int) -> tuple[int, int]:
    """Byte offset and checksum of a full chunk."""
    offset = dataset.id.get_chunk_info_by_coord((first_row,)).byte_offset
    return offset, zlib.crc32(dataset[first_row : first_row + n_rows].tobytes())
