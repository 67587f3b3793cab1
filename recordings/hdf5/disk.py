"""The file under an HDF5 file that is being written, and protection of the library from failures and Ctrl-C.

HDF5 cannot bear a write that fails, on a full disk say: it never lets the file go and crashes the interpreter at exit.
So the library writes through a Python object that takes everything, remembers the first failure, and raises it when
asked. Python runs signal handlers inside such an object too, so an interrupt has to wait until the library is left.
"""

from __future__ import annotations

import os
import shutil
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

from recordings.atomic_files import lock
from recordings.errors import BadInput

_LEAVE_ALONE = "leave a recording and its journal alone until it is closed"


class Disk:
    """A new file for `h5py.File(disk, "w")`, locked against other writers while it is open.

    Raises `OSError` when it cannot be made, `FileExistsError` when it is there.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0), 0o666)
        self._place = self._end = 0
        self._error: OSError | None = None
        lock(self._descriptor)

    @property
    def n_bytes(self) -> int:
        """Its size."""
        return os.fstat(self._descriptor).st_size

    def check(self) -> None:
        """Raise the first failure, if there was one."""
        if self._error:
            raise self._error

    def check_in_place(self, path: Path) -> None:
        """Raise `BadInput` when `path` is no longer this file, or something has shortened it."""
        own = os.fstat(self._descriptor)
        if own.st_size < self._end:
            raise BadInput(str(path), "it was truncated while it was being recorded", _LEAVE_ALONE)
        check_same(path, own)

    def put_back(self, path: Path) -> None:
        """Write the file again under its name, where nothing has that name: it was removed or moved."""
        if not path.exists():
            with path.open("xb") as copy, open(self._descriptor, "rb", closefd=False) as own:
                own.seek(0)
                shutil.copyfileobj(own, copy)

    def sync(self) -> None:
        """Force what was written onto the disk; raises the first failure."""
        self.check()
        os.fsync(self._descriptor)

    def close(self) -> None:
        """Let the file and its lock go. What the library would still write then goes nowhere."""
        descriptor, self._descriptor = self._descriptor, -1
        os.close(descriptor)

    # What HDF5 calls, by the names h5py wants.

    def seek(self, place: int, whence: int = os.SEEK_SET) -> int:
        self._place = place if whence == os.SEEK_SET else os.fstat(self._descriptor).st_size
        return self._place

    def tell(self) -> int:
        return self._place

    def read(self, n_bytes: int) -> bytes:
        return os.pread(self._descriptor, n_bytes, self._place).ljust(n_bytes, b"\0")

    def write(self, data: bytes | bytearray) -> int:
        left = memoryview(data)
        try:
            while left and not self._error:
                done = os.pwrite(self._descriptor, left, self._place)
                self._place, left = self._place + done, left[done:]
                self._end = max(self._end, self._place)
        except OSError as error:
            self._error = error
        return len(data)

    def truncate(self, size: int) -> int:
        try:
            if not self._error:
                os.ftruncate(self._descriptor, size)
                self._end = size
        except OSError as error:
            self._error = error
        return size

    def flush(self) -> None:
        """Nothing is held back here."""


def check_same(path: Path, own: os.stat_result) -> None:
    """Raise `BadInput` when a name does not lead to an open file any more."""
    try:
        there = path.stat()
    except FileNotFoundError:
        raise BadInput(str(path), "it was removed or moved while it was being recorded", _LEAVE_ALONE) from None
    if not os.path.samestat(own, there):
        raise BadInput(str(path), "another file took its place while it was being recorded", _LEAVE_ALONE)


@contextmanager
def new_hdf5(path: Path) -> Iterator[h5py.File]:
    """Make an HDF5 file and close it; raises `OSError` when the disk refused anything in between."""
    disk = Disk(path)
    try:
        with undisturbed(), h5py.File(disk, "w", track_order=True) as file:
            yield file
        disk.check()
    finally:
        disk.close()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Hold Ctrl-C back until the block is left. Other threads than the main one are never interrupted anyway."""
    before: Any = signal.getsignal(signal.SIGINT)
    if before is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[Any] = []
    signal.signal(signal.SIGINT, lambda number, frame: held.append(frame))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if held and callable(before):
            before(signal.SIGINT, held[0])
        elif held:
            signal.raise_signal(signal.SIGINT)
