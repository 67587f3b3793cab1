"""`bristle record`: a live source into recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from hil import RecorderReport


def command(
    source: Annotated[
        str, typer.Option(help="tcp://HOST:PORT, tls://HOST:PORT?ca=..&cert=..&key=.., rtu:DEVICE?baud=.., replay:REC")
    ],
    to: Annotated[Path, typer.Option(help="Directory, or a new file ending in .h5 for one valve.")],
    map_: Annotated[str | None, typer.Option("--map", help="Register map: a TOML or CSV file, or a shipped one.")] = None,
    rate: Annotated[float | None, typer.Option(help="Polls per second; without it 10.", min=1e-4, max=1e4)] = None,
    duration: Annotated[float | None, typer.Option(help="Stop after so many seconds.", min=0.0)] = None,
    unit: Annotated[str | None, typer.Option(help="Device ids of equal valves on one line: 1,2,5-7.")] = None,
    valve: Annotated[str | None, typer.Option(help="Names of the valves, one for each device id: A,B,C.")] = None,
    ring: Annotated[bool, typer.Option("--ring", help="Fetch every sample that the device keeps in its ring.")] = False,
    heartbeat: Annotated[str | None, typer.Option(help="Point that must change, instead of the map's own.")] = None,
    heartbeat_s: Annotated[float, typer.Option(help="How long it may stand still [s].", min=1e-3)] = 2.0,
    rotate_mb: Annotated[float | None, typer.Option(help="Begin a new file at this size [MB].", min=0.01)] = None,
    rotate_minutes: Annotated[float | None, typer.Option(help="Begin a new file at this age [min].", min=1e-3)] = None,
    batch: Annotated[float, typer.Option(help="How long samples may wait for the disk [s].", min=0.01, max=60.0)] = 0.5,
    plant: Annotated[
        list[str] | None, typer.Option(help="What is known of the plant, NAME=VALUE: stroke_m=0.0381 (repeatable).")
    ] = None,
    title: Annotated[str | None, typer.Option(help="One line for plots and reports.")] = None,
    acknowledge: Annotated[bool, typer.Option("--acknowledge", help="Print FILE SAMPLES as soon as they are safe.")] = False,
) -> None:
    """Record live values into crash-safe recordings until --duration is over, or Ctrl-C or SIGTERM comes.

    Values that are not good are missing (NaN) and an event says why. Nothing is ever written to the plant.

    Example: bristle record --source tcp://127.0.0.1:5020 --map damadics --to runs/ --rate 10 --duration 60
    """
    import asyncio

    from hil import PollingDied, RecorderSettings, open_source, record_session
    from recordings import NegativeAnswer

    settings = RecorderSettings(
        to=to,
        rotate_mb=rotate_mb,
        rotate_s=None if rotate_minutes is None else 60.0 * rotate_minutes,
        batch_s=batch,
        title=title,
        plant=_plant(plant or []),
        acknowledge=(lambda path, n: print(path, n, flush=True)) if acknowledge else None,
    )
    live = open_source(source, *_reading(map_, unit, valve, ring, rate, heartbeat, heartbeat_s))
    try:
        end = asyncio.run(record_session(live, settings, duration, _show if sys.stderr.isatty() else None))
    except PollingDied as death:
        raise NegativeAnswer(f"{death}; what was recorded until then is in {to}") from death
    _summarise(end.report, end.seconds)
    if end.interrupted:
        raise KeyboardInterrupt
    if not end.report.samples:
        raise NegativeAnswer(f"{source}: no sample came in {end.seconds:.1f} s, nothing was recorded")
