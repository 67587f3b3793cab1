"""`bristle monitor` with a plant file: what it would do, or the service itself."""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from bristle.cli.output.manner import answer, note, say
from bristle.cli.output.terminal import plain_text
from bristle.cli.watching.live_page import announce, plant_page
from hil import Page, PageSettings, PlantFile, Service, ServicePlan, ServiceSession, ServiceTask, run_service
from recordings import BadInput, NegativeAnswer


class _PlainFormatter(logging.Formatter):
    """Texts of devices and files must not command a terminal."""

    def format(self, record: logging.LogRecord) -> str:
        return plain_text(super().format(record))


def plant_service(
    file: Path | None, check: bool, duration_s: float | None, metrics: str | None, program: Path | None,
    page: PageSettings | None = None,
) -> None:  # fmt: skip
    """Check a plant file, or run it. page : instead of the file's.

    Raises BadInput, and NegativeAnswer when there was an alarm.
    """
    if file is None:
        raise BadInput("--check", "no plant file is named", "write bristle monitor --check plant.toml")
    plan = ServicePlan.of(PlantFile.read(file))
    if check:
        lines = plan.words().splitlines()
        say(*lines)
        answer({"plan": lines})
        return
    _log_to_stderr()
    settings = page or plant_page(plan.plant)
    with ExitStack() as opened:

        def more(service: Service) -> Mapping[str, ServiceTask]:
            if settings is None:
                return {}
            kept = plan.plant.recordings
            shown = opened.enter_context(
                Page(settings, service, plan.plant.path(kept.folder) if kept is not None else None)
            )
            announce(shown)
            return {"page": shown.run}

        end = asyncio.run(run_service(plan, ServiceSession(duration_s, metrics, program, more, _started)))
    note(f"{end.alarms} alarms in {end.seconds:.1f} s")
    answer({"alarms": end.alarms, "seconds": end.seconds})
    if end.stopped_by is signal.SIGINT:
        raise KeyboardInterrupt
    if end.alarms:
        raise NegativeAnswer(f"alarms raised: {end.alarms}")


def _started(service: Service) -> None:
    note(f"watching {len(service.plan.valves)} valves; Ctrl-C ends it")


def _log_to_stderr() -> None:
    """What the service logs, a line each: journald adds the time."""
    handler = logging.StreamHandler()
    handler.setFormatter(_PlainFormatter("%(message)s"))
    log = logging.getLogger("bristle.monitor")
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False
