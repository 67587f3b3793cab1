"""What was recorded of a valve: which files there are, and what one of them shows."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.page.views.words import clock
from recordings import Array, BadInput, Recording, envelope, open_recording

MOST_FILES = 200
LOOK_S = 5.0
"""Between two looks into the folder [s]."""

MOST_SAMPLES = 20_000_000
"""Of a recording that is drawn here: more would take the machine away from the monitor."""

STAMP = re.compile(r"-(\d{8}T\d{6}Z)-(\d+)$")


@dataclass(frozen=True)
class HistoryFile:
    """A recording to choose. name : of the file; words : what is shown of it."""

    name: str
    words: str


@dataclass(frozen=True)
class RecordedHistory:
    """Columns for drawing. samples : t [POSIX ms], position [mm]; wanted : t, setpoint [mm], empty where none is."""

    samples: Mapping[str, Array]
    wanted: Mapping[str, Array]


class RecordedHistories:
    """The recordings of a valve, looked for now and then. folder : None where nothing is recorded."""

    def __init__(self, folder: Path | None, tag: str) -> None:
        self._folder, self._tag = folder, tag
        self._found: Sequence[HistoryFile] = ()
        self._looked = -LOOK_S

    @property
    def files(self) -> Sequence[HistoryFile]:
        """What there is, the newest first."""
        if time.monotonic() - self._looked >= LOOK_S and self._folder is not None:
            self._found, self._looked = _recorded(self._folder, self._tag), time.monotonic()
        return self._found

    def path(self, name: str) -> Path | None:
        """The file of a name that is among them; None for any other text."""
        known = self._folder is not None and name in {one.name for one in self._found}
        return self._folder / name if self._folder is not None and known else None


def _recorded(folder: Path, tag: str) -> Sequence[HistoryFile]:
    found = [(*_stamp(path, tag), path.name) for path in folder.glob("*.h5") if _stamp(path, tag) != ("", 0)]
    return [
        HistoryFile(name, f"{stamp[:4]}-{stamp[4:6]}-{stamp[6:8]} {stamp[9:11]}:{stamp[11:13]} UTC, file {part}")
        for stamp, part, name in sorted(found, reverse=True)[:MOST_FILES]
    ]


def history_of(path: Path) -> RecordedHistory:
    """Read a recording for drawing. Raises BadInput when it cannot be read, or is too long to be drawn here."""
    with open_recording(path) as file:
        if len(file) > MOST_SAMPLES:
            raise BadInput(path.name, f"it has {len(file)} samples", "draw it with bristle show")
        wanted = [name for name in ("position", "setpoint") if name in file.specs]
        recording = file.load(wanted)
    began = recording.created.timestamp() if recording.created else 0.0
    return RecordedHistory(_column(recording, "position", began), _column(recording, "setpoint", began))


def about(history: RecordedHistory) -> str:
    """From when to when it goes."""
    times = history.samples["t"]
    if not len(times):
        return "It holds no position."
    return f"From {clock(float(times[0]) / 1e3, day=True)} to {clock(float(times[-1]) / 1e3, day=True)} UTC."


def _stamp(path: Path, tag: str) -> tuple[str, int]:
    """When the recording of a valve began, and which of its files this is; empty for another valve's."""
    found = STAMP.search(path.stem)
    if found is None or path.stem[: found.start()] != tag:
        return "", 0
    return found[1], int(found[2])


def _column(recording: Recording, name: str, began: float) -> Mapping[str, Array]:
    if name not in recording:
        return {"t": np.zeros(0), name: np.zeros(0)}
    time, values = envelope(recording.time, 1e3 * recording.si(name).values)
    return {"t": 1e3 * (began + time), name: values}
