"""Events to a program: started once for every event, without a shell, with the event's line on its standard input."""

from __future__ import annotations

import logging
import subprocess
from collections.abc import Sequence
from pathlib import Path

from hil.monitor.event import MonitorEvent

PATIENCE_S = 30.0
LOG = logging.getLogger("bristle.monitor")


class ProgramSink:
    """Runs a program. One that fails is logged, and its event is not given again: it may have done half of its work."""

    def __init__(self, program: Path) -> None:
        self.name = f"events {program.name}"
        self._program = program

    def send(self, events: Sequence[MonitorEvent]) -> None:
        """Run it for each event; one that takes longer than `PATIENCE_S` is ended."""
        for event in events:
            line = event.json_line() + "\n"
            try:
                subprocess.run(
                    [self._program], input=line, text=True, timeout=PATIENCE_S, check=True, stdout=subprocess.DEVNULL
                )
            except (OSError, subprocess.SubprocessError) as error:
                LOG.warning("%s: %s", self._program, error)

    def close(self) -> None:
        """Nothing is open."""
