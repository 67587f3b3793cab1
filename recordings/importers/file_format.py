"""The kinds of file that can be imported, found in `formats/`, and which of them a file is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from pathlib import Path

import h5py

from recordings.atomic_files import check_regular
from recordings.discovery import instances_of
from recordings.errors import BadInput
from recordings.hdf5.layout_reader import FORMAT
from recordings.hdf5.opening import journal_path, open_hdf5, starts_like_hdf5
from recordings.hdf5.problems import h5py_errors
from recordings.importers.mapping import FileLayout
from recordings.importers.table import ForeignTable

HEAD_BYTES = 8
"""What a format is shown of a file's start."""


class Match(IntEnum):
    """How well a file fits a format; the best fit reads it."""

    NO = 0
    REST = 1
    """Whatever nothing else fits."""
    NAME = 2
    CONTENT = 3


@dataclass(frozen=True)
class FileFormat:
    """A kind of file that can be imported.

    name : in words; match(path, head) : how well a file fits, by its first bytes and its name; read(path, layout,
    texts) : its table. `texts` are columns wanted as text besides numbers. A reader raises BadInput.
    """

    name: str
    match: Callable[[Path, bytes], Match]
    read: Callable[[Path, FileLayout, Sequence[str | int]], ForeignTable]


@cache
def file_formats() -> tuple[FileFormat, ...]:
    """Every format that a module of `formats/` assigns to a name in capitals."""
    return tuple(instances_of("recordings.importers.formats", FileFormat))


def is_recording(path: Path) -> bool:
    """Whether a file is a recording already, or one that was cut off. Raises BadInput for an unreadable file."""
    if journal_path(path).exists():  # a recording that was cut off; its file may be damaged beyond recognition
        return True
    check_regular(path)
    if not starts_like_hdf5(path):
        return False
    with open_hdf5(path) as file, h5py_errors(str(path)):
        return _plain(file) == FORMAT


def format_of(path: Path) -> FileFormat:
    """The format that a file fits best. Raises BadInput for a spreadsheet."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    best = max(file_formats(), key=lambda one: one.match(path, head))
    if head[:4] == b"PK\x03\x04" and best.match(path, head) < Match.CONTENT:
        raise BadInput(str(path), "it is a spreadsheet or an archive", "save the table as CSV and import that")
    return best


def _plain(file: h5py.File) -> object:
    value = file.attrs.get("format")
    return value.decode(errors="replace") if isinstance(value, bytes) else value
