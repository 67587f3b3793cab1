"""What kind of file something is, by its content and not by its name."""

from __future__ import annotations

from pathlib import Path

import h5py

from recordings.atomic_files import check_regular
from recordings.errors import BadInput
from recordings.hdf5.layout_reader import FORMAT
from recordings.hdf5.opening import journal_path, open_hdf5, starts_like_hdf5
from recordings.hdf5.problems import h5py_errors


def kind_of(path: Path) -> str:
    """``recording``, ``hdf5``, ``mat``, ``parquet`` or ``text``; `BadInput` for a spreadsheet or an unreadable file."""
    if journal_path(path).exists():  # a recording that was cut off; its file may be damaged beyond recognition
        return "recording"
    check_regular(path)
    with path.open("rb") as file:
        head = file.read(8)
    if starts_like_hdf5(path):
        return "recording" if _is_recording(path) else "hdf5"
    if head[:4] == b"PAR1":
        return "parquet"
    if head[:4] == b"PK\x03\x04":
        raise BadInput(str(path), "it is a spreadsheet or an archive", "save the table as CSV and import that")
    if head[:6] == b"MATLAB" or path.suffix.lower() == ".mat":
        return "mat"
    return "text"


def _is_recording(path: Path) -> bool:
    with open_hdf5(path) as file, h5py_errors(str(path)):
        return _plain(file) == FORMAT


def _plain(file: h5py.File) -> object:
    value = file.attrs.get("format")
    return value.decode(errors="replace") if isinstance(value, bytes) else value
