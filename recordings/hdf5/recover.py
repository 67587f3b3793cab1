"""Putting a recording right whose writer was killed or lost its power, from its journal."""

from __future__ import annotations

import io
import os
import shutil
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np

from recordings.arrays import Array
from recordings.atomic_files import appearing, lock, sync, writing
from recordings.errors import BadInput
from recordings.hdf5.columns import StoredColumn
from recordings.hdf5.disk import new_hdf5
from recordings.hdf5.journal import Contents, read_journal
from recordings.hdf5.layout_writer import append_events, append_samples, create_columns, create_events, write_header
from recordings.hdf5.opening import journal_path
from recordings.hdf5.problems import hdf5_refusals
from recordings.hdf5.reader import open_recording, validate
from recordings.hdf5.recorded_file import RecordedFile, recorded_file
from recordings.plant import Event
from recordings.sample_checks import ALL_MISSING

_FORGED = "delete it if the recording beside it can be read without"


@dataclass(frozen=True)
class Recovery:
    """What a recovery did.

    path : the recording; n_samples : how many it holds now; merged : whether there was anything to do;
    lost : a sentence for each stretch that is gone, empty when every acknowledged sample is there.
    """

    path: Path
    n_samples: int
    merged: bool
    lost: tuple[str, ...] = ()


def recover(path: str | Path) -> Recovery:
    """Merge the journal of an interrupted run into its recording and remove the journal.

    The file is built anew and takes the old one's place in one step, so a recovery that is itself interrupted can be
    repeated, and one that is not needed does nothing. When the disk has lost part of the file, that stretch is a gap
    with an event of the kind ``gap``, and the damaged file is kept under its name plus ``.damaged``.

    Raises
    ------
    BadInput
        A living process still writes the recording, the journal cannot be read, there is none and the file is no
        recording, or the disk refused.
    """
    path = Path(path)
    journal = journal_path(path)
    if not journal.exists():
        with open_recording(path) as file:
            return Recovery(path, len(file), merged=False)
    with writing(path), hdf5_refusals(path), _alone_with(path), recorded_file(path) as stored:
        try:
            contents = read_journal(path)
        except BadInput:
            if stored is None:  # neither the one nor the other
                raise
            contents = stored.contents()
        if stored is not None and contents.damaged:
            contents.events += [event for event in stored.events if event not in contents.events]
        n_samples = _finished(path, contents, stored)
        if n_samples is None:
            n_samples, lost = _rebuild(path, contents, stored if contents.damaged else None)
            result = Recovery(path, n_samples, merged=True, lost=lost)
        else:
            result = Recovery(path, n_samples, merged=False)
        journal.unlink()
        sync(path.parent)
    return result


@contextmanager
def _alone_with(path: Path) -> Iterator[None]:
    """Hold the writer's lock, so that nobody writes meanwhile."""
    if not path.exists():
        yield
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        lock(descriptor)
        yield
    except BlockingIOError:
        raise BadInput(str(path), "it is still being recorded", "stop the recorder first") from None
    finally:
        os.close(descriptor)


def _finished(path: Path, contents: Contents, stored: RecordedFile | None) -> int | None:
    """The samples of a file that an earlier recovery built, or that its writer closed and the journal agrees with; None
    for one still to be rebuilt.
    """
    if stored is None or stored.mark not in {f"closed {contents.run}", f"merged {contents.run}"}:
        return None
    if _problems(path) or (stored.mark.startswith("closed") and not _agree(path, contents, stored)):
        return None
    return len(stored)


def _problems(path: Path) -> list[BadInput]:
    """What no recorder writes. One whose map did not fit its device has written nothing but missing samples."""
    return [problem for problem in validate(path) if problem.found != ALL_MISSING]


def _agree(path: Path, contents: Contents, stored: RecordedFile) -> bool:
    """Whether a closed file holds what its journal says, sample by sample."""
    blocks = _blocks(path, contents, None)
    return all(not lost and stored.same(first_row, columns) for first_row, columns, lost in blocks)


def _rebuild(path: Path, contents: Contents, stored: RecordedFile | None) -> tuple[int, tuple[str, ...]]:
    """Build the recording anew from the chunks on the disk, the rows in the journal, and the file where both lack."""
    names = [column.label for column in contents.columns]
    clock, losses = names.index("time"), list[_Loss]()
    with appearing(path) as draft:
        with new_hdf5(draft) as file:
            write_header(file, contents.header)
            file.attrs["journal"] = f"merged {contents.run}"
            storage = {"shape": (0,), "maxshape": (None,), "chunks": (contents.chunk_rows,)}
            datasets = create_columns(file, contents.header, **storage)
            for first_row, columns, lost in _blocks(path, contents, stored):
                if lost:
                    _note(losses, names, lost, first_row, columns.shape[1], len(datasets[clock]))
                if clock not in lost:  # without its time a sample cannot be placed
                    for column, dataset, values in zip(contents.columns, datasets, columns, strict=True):
                        append_samples(dataset, column.stored(values))
            create_events(file)
            append_events(file, [*contents.events, *_gaps(losses, datasets[clock])])
            n_samples = len(datasets[clock])
        problems = _problems(draft) if n_samples > 1 else []
        if problems:  # a journal that was made up, not damaged
            raise BadInput(str(path), f"what its journal says makes no recording ({problems[0].found})", _FORGED)
        if losses:
            _keep_damaged(path)
    return n_samples, tuple(loss.sentence for loss in losses)


def _blocks(path: Path, contents: Contents, stored: RecordedFile | None) -> Iterator[tuple[int, Array, list[int]]]:
    """(first row, values of shape (n_columns, n_rows), which columns are lost) from the start of the recording on.

    Rows of which the journal says nothing any more are taken from the file, and are lost where it does not have them.
    """
    n_columns, place = len(contents.columns), 0
    for first_row, columns, lost in _journalled(path, contents):
        if first_row > place:
            between = None if stored is None else stored.rows(place, first_row)
            if between is None:
                gone = np.broadcast_to(np.nan, (n_columns, first_row - place))
                yield place, gone, list(range(n_columns))
            else:
                yield place, between, []
        fresh = max(place - first_row, 0)  # a batch may begin with rows that are known already
        if fresh < columns.shape[1]:
            yield first_row + fresh, columns[:, fresh:], lost
        place = max(place, first_row + columns.shape[1])
    behind = None if stored is None else stored.rows(place, len(stored))
    if behind is not None and behind.shape[1]:
        yield place, behind, []


def _journalled(path: Path, contents: Contents) -> Iterator[tuple[int, Array, list[int]]]:
    """The same of what the journal speaks of, in order."""
    rows = sorted(contents.rows, key=lambda batch: batch[0])
    in_journal = rows[0][0] if rows else None
    file = path.open("rb") if path.exists() else io.BytesIO()
    with file:
        for chunk in sorted(contents.chunks, key=lambda chunk: chunk.first_row):
            if in_journal is None or chunk.first_row < in_journal:
                stored = zip(contents.columns, chunk.places, strict=True)
                parts = [_stored(file, column, place, contents.chunk_rows) for column, place in stored]
                gone = np.full(contents.chunk_rows, np.nan)
                columns = np.stack([gone if part is None else part for part in parts])
                yield chunk.first_row, columns, [k for k, part in enumerate(parts) if part is None]
    for first_row, columns in rows:
        yield first_row, columns, []


def _stored(file: BinaryIO, column: StoredColumn, place: tuple[int, int], rows: int) -> Array | None:
    """One chunk from its bytes in the file; None when they are not those that were written."""
    offset, checksum = place
    file.seek(offset)
    n_bytes = column.dtype.itemsize * rows
    data = file.read(n_bytes)
    return column.from_bytes(data) if len(data) == n_bytes and zlib.crc32(data) == checksum else None


@dataclass(frozen=True)
class _Loss:
    """A stretch that the disk did not keep: of which signals, its rows, and the row at which it is missing now."""

    what: str
    first_row: int
    n_rows: int
    place: int

    @property
    def sentence(self) -> str:
        last_row = self.first_row + self.n_rows - 1
        return f"{self.what}: samples {self.first_row} to {last_row} are lost, the disk did not keep them"


def _note(losses: list[_Loss], names: list[str], lost: list[int], first_row: int, n_rows: int, place: int) -> None:
    """Add a lost chunk, joined to the loss before when it continues it."""
    what = "all signals" if "time" in (gone := [names[k] for k in lost]) else ", ".join(gone)
    before = losses[-1] if losses else None
    if before and before.what == what and before.first_row + before.n_rows == first_row:
        losses[-1] = replace(before, n_rows=before.n_rows + n_rows)
    else:
        losses.append(_Loss(what, first_row, n_rows, place))


def _gaps(losses: list[_Loss], clock: h5py.Dataset) -> list[Event]:
    """One event for each loss, at the last sample before it."""
    return [Event(float(clock[max(loss.place - 1, 0)]), "gap", loss.sentence) for loss in losses if len(clock)]


def _keep_damaged(path: Path) -> None:
    if path.exists():
        kept = path.with_name(path.name + ".damaged")
        kept.unlink(missing_ok=True)
        try:
            kept.hardlink_to(path)
        except OSError:  # not every file system knows links
            shutil.copyfile(path, kept)
