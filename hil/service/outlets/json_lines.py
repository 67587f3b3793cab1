"""Events as JSON lines: into a file that is opened for every batch, so that it may be moved, or printed."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from hil.monitor.event import MonitorEvent


class JsonLines:
    """Appends events to a file; on the disk once `send` returns."""

    def __init__(self, path: Path) -> None:
        self.name = f"events {path.name}"
        self._path = path

    def send(self, events: Sequence[MonitorEvent]) -> None:
        """Append a line for each. Raises OSError."""
        with self._path.open("a", encoding="utf-8") as file:
            file.write("".join(event.json_line() + "\n" for event in events))
            file.flush()
            os.fsync(file.fileno())

    def close(self) -> None:
        """Nothing is open."""


class Printed:
    """Prints events on standard output."""

    name = "events printed"

    def send(self, events: Sequence[MonitorEvent]) -> None:
        """Print a line for each. Raises OSError when nobody listens any more."""
        sys.stdout.write("".join(event.json_line() + "\n" for event in events))
        sys.stdout.flush()

    def close(self) -> None:
        """Nothing is open."""
