"""A recording of which nobody knows how long it will last must not take more memory with every event."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import ctypes, sys
from datetime import UTC, datetime
from recordings import Event, RecordingWriter, SignalSpec

names = ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keep")
class Said(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in names]
library = ctypes.CDLL(None)
library.mallinfo2.restype = Said

specs = [SignalSpec("time", "s", "time"), SignalSpec("position", "m", "output")]
with RecordingWriter(sys.argv[1], specs, created=datetime.now(UTC)) as writer:
    writer.append({"time": [0.0, 1.0], "position": [0.0, 0.1]})
    for k in range(3300):
        if k == 1800:  # what is kept of the file's structure is full
            began = library.mallinfo2().uordblks
        writer.event(Event(float(k), "deadline_missed", "3 deadlines missed in 1.0 s"))
    print(library.mallinfo2().uordblks - began)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="malloc is asked as glibc has it")
def test_events_take_no_memory_for_ever(tmp_path: Path) -> None:
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "run.h5")]
    grown = float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert grown < 100e3, "bytes for 1500 events"
