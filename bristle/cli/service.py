"""`bristle monitor` with a plant file: what it would do, or the service itself."""

from __future__ import annotations

import asyncio
import logging
import signal
import sys
from pathlib import Path

from bristle.cli.terminal import plain_text
from hil import PlantFile, Service, ServicePlan, ServiceSession, run_service
from recordings import BadInput, NegativeAnswer


class _PlainFormatter(logging.Formatter):
    """Texts of devices and files must not command a terminal."""

    def format(self, record: logging.LogRecord) -> str:
        return plain_text(super().format(record))


def plant_service(
    file: Path | None, check: bool, duration_s: float | None, metrics: str | None, program: Path | None
) -> None:
    """Check a plant file, or run it. Raises BadInput, and NegativeAnswer when there was an alarm."""
    if file is None:
        raise BadInput("--check", "no plant file is named", "write bristle monitor --check plant.toml")
    plan = ServicePlan.of(PlantFile.read(file))
    if check:
        print(plain_text_lines(plan.words()))
        return
    _log_to_stderr()
    end = asyncio.run(run_service(plan, ServiceSession(duration_s, metrics, program, started=_started)))
    print(f"{end.alarms} alarms in {end.seconds:.1f} s", file=sys.stderr)
    if end.stopped_by is signal.SIGINT:
        raise KeyboardInterrupt
    if end.alarms:
        raise NegativeAnswer(f"{end.alarms} alarms were raised")


def plain_text_lines(text: str) -> str:
    """Many lines, each as a terminal can show it."""
    return "\n".join(plain_text(line) for line in text.splitlines())


def _started(service: Service) -> None:
    print(f"watching {len(service.plan.valves)} valves; Ctrl-C ends it", file=sys.stderr, flush=True)


def _log_to_stderr() -> None:
    """What the service logs, a line each: journald adds the time."""
    handler = logging.StreamHandler()
    handler.setFormatter(_PlainFormatter("%(message)s"))
    log = logging.getLogger("bristle.monitor")
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False
