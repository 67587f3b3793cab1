"""What was measured: recordings of a valve, their file format, reading, crash-safe writing, and import.

>>> from recordings import bundled_names, read
>>> read("nowhere.h5")
Traceback (most recent call last):
    ...
recordings.errors.BadInput: nowhere.h5: there is no such file; check the path
"""

from recordings.arrays import Array, IndexArray, Integers
from recordings.atomic_files import appearing, json_text, may_pass, save_json, save_text
from recordings.column_headers import did_you_mean
from recordings.discovery import classes_of, instances_of
from recordings.errors import (
    BadInput,
    BadParameter,
    BristleError,
    LinkError,
    NegativeAnswer,
    ProtocolError,
    not_installed,
)
from recordings.exchange import write_table
from recordings.hdf5.header import Header, Origin
from recordings.hdf5.live import RecordingWriter
from recordings.hdf5.reader import RecordingFile, open_recording, read, validate
from recordings.hdf5.recover import Recovery, recover
from recordings.hdf5.writer import Truth, read_truth, write
from recordings.library import BUNDLED, bundled, bundled_names, bundled_path, file_of
from recordings.noise import quiet_noise, white_noise
from recordings.plant import Event, Plant
from recordings.progress import Progress, silent, tracked
from recordings.recording import Codes, Recording
from recordings.sample_checks import LARGEST, NOT_KNOWN, QUALITIES
from recordings.signal import ROLES, UNDERSTOOD, Role, Signal, SignalSpec
from recordings.text_files import check_depth, read_small_json, read_small_text, read_small_toml
from recordings.units import UNITS, Unit, convert, find_unit, unit
from recordings.views.description import describe
from recordings.views.drawing import drawn
from recordings.views.page import picture
from recordings.views.pictures import envelope
from recordings.views.report_opening import OpeningWord, ReportOpening

__all__ = [
    "BUNDLED",
    "LARGEST",
    "NOT_KNOWN",
    "QUALITIES",
    "ROLES",
    "UNDERSTOOD",
    "UNITS",
    "Array",
    "BadInput",
    "BadParameter",
    "BristleError",
    "Codes",
    "Event",
    "Header",
    "IndexArray",
    "Integers",
    "LinkError",
    "NegativeAnswer",
    "OpeningWord",
    "Origin",
    "Plant",
    "Progress",
    "ProtocolError",
    "Recording",
    "RecordingFile",
    "RecordingWriter",
    "Recovery",
    "ReportOpening",
    "Role",
    "Signal",
    "SignalSpec",
    "Truth",
    "Unit",
    "appearing",
    "bundled",
    "bundled_names",
    "bundled_path",
    "check_depth",
    "classes_of",
    "convert",
    "describe",
    "did_you_mean",
    "drawn",
    "envelope",
    "file_of",
    "find_unit",
    "instances_of",
    "json_text",
    "may_pass",
    "not_installed",
    "open_recording",
    "picture",
    "quiet_noise",
    "read",
    "read_small_json",
    "read_small_text",
    "read_small_toml",
    "read_truth",
    "recover",
    "save_json",
    "save_text",
    "silent",
    "tracked",
    "unit",
    "validate",
    "white_noise",
    "write",
    "write_table",
]
