"""`bristle replay`: the detector over a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option


def command(
    recording: Annotated[str, Argument(help="The recording to watch (.h5); bundled:NAME works too.")],
    model: Annotated[Path, Option(help="Model of the valve, from bristle fit or trace.")],
    learn: Annotated[
        float | None, Option(help="Learn from so many seconds, or more until the valve has moved.", min=1.0, max=1e9)
    ] = None,
    calibrate: Annotated[list[str] | None, Option(help="Learn from this healthy recording (repeat).")] = None,
    state: Annotated[Path | None, Option(help="Resume from what was learned here, and save it here.")] = None,
    false_alarms: Annotated[float, Option(help="Allowed false alarms a month.", min=1e-3, max=1e4)] = 1.0,
    events: Annotated[Path | None, Option(help="Append events to this file instead of printing them.")] = None,
    valve: Annotated[str | None, Option(help="Name of the valve; the recording's own otherwise.")] = None,
    report: Annotated[Path | None, Option(help="Write a self-contained HTML page here.")] = None,
    pace: Annotated[float | None, Option(help="Times real time; as fast as possible otherwise.", min=1e-3)] = None,
) -> None:
    """Watch a recording as if it were live: the same detector, the same events. Exit code 1 when there was an alarm.

    Example: bristle replay runs/LC74_20-001.h5 --model model.json --learn 300
    """
    from bristle.cli.watching import monitoring
    from hil import open_source
    from recordings import file_of

    address = f"replay:{file_of(recording)}" + (f"?pace={pace:g}" if pace else "")
    options = monitoring.MonitorOptions(
        model, learn, calibrate or (), state, false_alarms, events, own_clock=True, recording=recording, report=report
    )
    monitoring.watch(open_source(address, name=valve), options)
