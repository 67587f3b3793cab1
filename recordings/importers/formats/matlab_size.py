"""How large a MATLAB file of version 5 to 7 becomes when it is unpacked, before anything is kept of it."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from recordings.importers.table import check_expansion

_HEAD_BYTES, _ENDIAN = 128, slice(126, 128)
_COMPRESSED = 15
_STEP = 1 << 16


def check_unpacked(path: Path) -> None:
    """Refuse a file whose compressed variables unpack into more than a file of its size can hold. Raises BadInput.

    Only sizes are looked at: what is damaged is for the reader to say.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
        order = {b"IM": "<", b"MI": ">"}.get(head[_ENDIAN])
        if order is None:  # version 4 is not compressed: what it declares must be there
            return
        n_bytes = 0
        for size in _elements(file, order):
            n_bytes += size
            check_expansion(path, n_bytes // 8)


def _elements(file: BinaryIO, order: str) -> Iterator[int]:
    """The bytes of every variable, compressed ones bit by bit as they are unpacked."""
    end = os.fstat(file.fileno()).st_size
    while len(tag := file.read(8)) == 8:
        kind, size = struct.unpack(f"{order}II", tag)
        size = min(size, end - file.tell())
        if kind != _COMPRESSED:
            yield size
            file.seek(size, os.SEEK_CUR)
        else:
            yield from _unpacked(file, size)


def _unpacked(file: BinaryIO, size: int) -> Iterator[int]:
    inflate = zlib.decompressobj()
    while size > 0 and not inflate.eof:
        data = file.read(min(size, _STEP))
        size -= len(data)
        try:
            while data:
                yield len(inflate.decompress(data, _STEP))
                data = inflate.unconsumed_tail
        except zlib.error:
            break
    file.seek(max(size, 0), os.SEEK_CUR)
