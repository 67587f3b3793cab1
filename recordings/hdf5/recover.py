"""Putting a recording right whose writer was killed or lost its power, from its journal."""

from __future__ import annotations

import fcntl
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
from recordings.atomic_files import appearing, sync, writing
from recordings.errors import BadInput
from recordings.hdf5.disk import new_hdf5
from recordings.hdf5.items import raw_attribute
from recordings.hdf5.journal import Contents, read_journal
from recordings.hdf5.layout_reader import layout_of
from recordings.hdf5.layout_writer import append_events, append_samples, create_events, create_signal, write_header
from recordings.hdf5.opening import journal_path
from recordings.hdf5.problems import Problems
from recordings.hdf5.reader import open_recording, opened
from recordings.plant import Event


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
    with writing(path), _alone_with(path):
        contents = read_journal(path)
        n_samples = _finished(path, contents.run)
        if n_samples is None:
            n_samples, lost = _rebuild(path, contents)
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
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        raise BadInput(str(path), "it is still being recorded", "stop the recorder first") from None
    finally:
        os.close(descriptor)


def _finished(path: Path, run: str) -> int | None:
    """The samples of a file that its writer closed or an earlier recovery built; None for one still to be rebuilt."""
    try:
        with opened(path) as file:
            if raw_attribute(file, "journal") in {f"closed {run}", f"merged {run}"}:
                layout = layout_of(file, str(path), Problems(keep_going=False))
                return layout.n_samples if layout else None
    except BadInput:
        pass  # a damaged file is what the journal is for
    return None


def _rebuild(path: Path, contents: Contents) -> tuple[int, tuple[str, ...]]:
    """Build the recording anew from the chunks on the disk and the rows in the journal."""
    names = [spec.name for spec in contents.header.signals]
    clock, losses = names.index("time"), list[_Loss]()
    with appearing(path) as draft, new_hdf5(draft) as file:
        write_header(file, contents.header)
        file.attrs["journal"] = f"merged {contents.run}"
        storage = {"shape": (0,), "maxshape": (None,), "chunks": (contents.chunk_rows,)}
        datasets = [create_signal(file, spec, **storage) for spec in contents.header.signals]
        for first_row, columns, lost in _blocks(path, contents):
            if lost:
                _note(losses, names, lost, first_row, columns.shape[1], len(datasets[clock]))
            if clock not in lost:  # without its time a sample cannot be placed
                for dataset, values in zip(datasets, columns, strict=True):
                    append_samples(dataset, values)
        create_events(file)
        append_events(file, [*contents.events, *_gaps(losses, datasets[clock])])
        if losses:
            _keep_damaged(path)
        return len(datasets[clock]), tuple(loss.sentence for loss in losses)


def _blocks(path: Path, contents: Contents) -> Iterator[tuple[int, Array, list[int]]]:
    """(first row, values of shape (n_signals, n_rows), which signals are lost) from the start of the recording on."""
    in_journal = contents.rows[0][0] if contents.rows else None
    file = path.open("rb") if path.exists() else io.BytesIO()
    with file:
        for chunk in contents.chunks:
            if in_journal is None or chunk.first_row < in_journal:
                parts = [_stored(file, place, contents.chunk_rows) for place in chunk.places]
                gone = np.full(contents.chunk_rows, np.nan)
                columns = np.stack([gone if part is None else part for part in parts])
                yield chunk.first_row, columns, [k for k, part in enumerate(parts) if part is None]
    for first_row, columns in contents.rows:
        yield first_row, columns, []


def _stored(file: BinaryIO, place: tuple[int, int], rows: int) -> Array | None:
    """One chunk from its bytes in the file; None when they are not those that were written."""
    offset, checksum = place
    file.seek(offset)
    data = file.read(8 * rows)
    return np.frombuffer(data, "<f8") if len(data) == 8 * rows and zlib.crc32(data) == checksum else None


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
