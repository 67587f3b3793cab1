"""The files of one recorded valve: opened when there is something to put in, changed when they are full or old."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np

from hil.recorder.notes import Notes
from hil.source.sample import LinkEvent
from recordings import BadInput, Event, Origin, Plant, RecordingWriter, SignalSpec, may_pass

Acknowledge = Callable[[Path, int], None]
"""Told after every batch which file holds how many samples that nothing can take any more."""

Tell = Callable[[LinkEvent], None]
"""Told every event when it comes, for whoever watches the session."""

RecordedRow = tuple[float, ...]
"""One sample: time, the values, the code of each value's quality, the time of its reply."""


@dataclass(frozen=True)
class RecorderSettings:
    """How and where a source is recorded.

    to : a directory, or a file ending in .h5 or .hdf5 for a single valve; rotate_mb, rotate_s : size [MB] and age [s]
    at which a new file is started; batch_s : how long samples may wait [s]; hold_s : how long they may be in the
    journal alone [s], see `RecordingWriter`; title, kind, plant : as in `Recording`;
    acknowledge : see `Acknowledge`, called from another thread; tell : see `Tell`; notes : become events of the
    recording; refuse_unusable : whether to end when none of a valve's first values is good.
    """

    to: Path
    rotate_mb: float | None = None
    rotate_s: float | None = None
    batch_s: float = 0.5
    hold_s: float = 0.0
    title: str | None = None
    kind: Origin | None = None
    plant: Plant = field(default_factory=Plant)
    acknowledge: Acknowledge | None = None
    tell: Tell | None = None
    notes: Notes | None = None
    refuse_unusable: bool = True

    @property
    def rotates(self) -> bool:
        """Whether there may be more than one file a valve."""
        return self.rotate_mb is not None or self.rotate_s is not None

    @property
    def is_file(self) -> bool:
        """Whether `to` names a file."""
        return self.to.suffix in (".h5", ".hdf5") and not self.to.is_dir()

    def check(self, valves: Sequence[str]) -> None:
        """Make the directory. Raises BadInput when nothing can be written there, or it is one file for many valves.

        A disk that is full or fails now is no mistake of who asks: the first batch will meet it, and a monitor goes on
        watching without its recording.
        """
        if self.is_file and len(valves) > 1:
            raise BadInput(str(self.to), f"it is one file, and there are {len(valves)} valves", "give a directory")
        if self.is_file and not self.rotates and self.to.exists():
            raise BadInput(str(self.to), "it exists already", "choose another name: nothing is overwritten")
        folder = self.to.parent if self.is_file else self.to
        trial = folder / f".writable-{secrets.token_hex(4)}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(trial, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
            trial.unlink()
            os.close(descriptor)
        except OSError as error:
            if may_pass(error):
                return
            found = f"nothing can be written there ({error.strerror})"
            raise BadInput(str(folder), found, "choose another directory, or change its permissions") from None


class FileSeries:
    """The recordings of one valve, one after the other, with one clock. Used by one thread.

    valve : its name; signals : what is recorded; created : the wall-clock time at which the clock was 0.
    A file is started with two samples at least, because one alone is no recording.
    """

    def __init__(
        self, valve: str, signals: Sequence[SignalSpec], created: datetime, settings: RecorderSettings
    ) -> None:
        self.valve, self._signals, self._created, self._settings = valve, tuple(signals), created, settings
        self.files: list[Path] = []
        self._names = [spec.name for spec in signals if spec.role != "time"]
        self._writer: RecordingWriter | None = None
        self._started = 0.0
        self._rows: list[RecordedRow] = []
        self._events: list[Event] = []

    def write(self, rows: Sequence[RecordedRow], events: Sequence[Event]) -> None:
        """Add samples and events; what is safe then is acknowledged."""
        self._rows += rows
        self._events += events
        if len(self._rows) >= 2 and (self._writer is None or self._is_full(self._writer)):
            self._begin()
        if self._writer is None:
            return
        if self._rows:
            columns, n = np.array(self._rows).T, len(self._names)
            self._rows = []
            parts = (columns[1 + k * n : 1 + (k + 1) * n] for k in range(3))
            values, quality, times = (dict(zip(self._names, part, strict=True)) for part in parts)
            self._writer.append({"time": columns[0]} | values, quality, times)
            if self._settings.acknowledge:
                self._settings.acknowledge(self._writer.path, len(self._writer))
        while self._events:
            self._writer.event(self._events.pop(0))

    @property
    def n_unrecorded(self) -> int:
        """How many samples came to no recording: a single one, when nothing followed it."""
        return len(self._rows)

    def close(self) -> None:
        """Finish the last file."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _begin(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None
        settings, path = self._settings, self._next_path()
        self._started = self._rows[0][0]
        self._writer = RecordingWriter(
            path,
            self._signals,
            plant=_tagged(settings.plant, self.valve),
            title=settings.title,
            source=settings.kind,
            created=self._created,
            attributes={"part": len(self.files) + 1} if settings.rotates else {},
            per_value=True,
            hold=settings.hold_s,
        )
        self.files.append(path)

    def _is_full(self, writer: RecordingWriter) -> bool:
        megabytes, seconds = self._settings.rotate_mb, self._settings.rotate_s
        too_large = megabytes is not None and writer.n_bytes >= megabytes * 1e6
        return too_large or (seconds is not None and self._rows[0][0] - self._started >= seconds)

    def _next_path(self) -> Path:
        """A free name. A file that a user named is used as it is; whatever stands in its way is the writer's to say."""
        to = self._settings.to
        if self._settings.is_file and not self._settings.rotates:
            return to
        stem = to.with_suffix("") if self._settings.is_file else to / f"{self.valve}-{self._created:%Y%m%dT%H%M%SZ}"
        number = len(self.files) + 1
        while any(stem.with_name(f"{stem.name}-{number:03d}.h5{end}").exists() for end in ("", ".journal")):
            number += 1
        return stem.with_name(f"{stem.name}-{number:03d}.h5")


def _tagged(plant: Plant, valve: str) -> Plant:
    return plant if plant.tag else Plant(**(plant.known() | {"tag": valve}))  # type: ignore[arg-type]
