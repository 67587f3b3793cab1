"""What was measured: recordings of a valve, their file format, reading, crash-safe writing, and import.

>>> from recordings import bundled_names, read
>>> read("nowhere.h5")
Traceback (most recent call last):
    ...
recordings._errors.BadInput: nowhere.h5: there is no such file; check the path
"""

from recordings._describe import describe
from recordings._errors import BadInput, NegativeAnswer
from recordings._files import save_text
from recordings._header import Header, Source
from recordings._live import RecordingWriter
from recordings._picture import picture
from recordings._plant import Event, Plant
from recordings._reader import RecordingFile, open_recording, read, validate
from recordings._recording import Recording
from recordings._recover import Recovery, recover
from recordings._signal import UNDERSTOOD, Array, Role, Signal, SignalSpec
from recordings._units import UNITS, Unit, convert, find_unit, unit
from recordings._writer import read_truth, write
from recordings.library import bundled, bundled_names, bundled_path

__all__ = [
    "UNDERSTOOD",
    "UNITS",
    "Array",
    "BadInput",
    "Event",
    "Header",
    "NegativeAnswer",
    "Plant",
    "Recording",
    "RecordingFile",
    "RecordingWriter",
    "Recovery",
    "Role",
    "Signal",
    "SignalSpec",
    "Source",
    "Unit",
    "bundled",
    "bundled_names",
    "bundled_path",
    "convert",
    "describe",
    "find_unit",
    "open_recording",
    "picture",
    "read",
    "read_truth",
    "recover",
    "save_text",
    "unit",
    "validate",
    "write",
]
