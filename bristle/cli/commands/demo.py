"""`bristle demo`: the main job end to end, from a bundled example to a valve that is watched."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    out: Annotated[Path, typer.Option(help="Folder for recordings, models, reports and events.")] = Path("demo-output"),
) -> None:
    """Fit a bundled valve; record another over Modbus, trace what its model lacks, watch it, and find a fault.

    The second valve is simulated, in a process of its own on loopback, with an effect that the model does not have.
    Takes about a minute.

    Example: bristle demo --out demo-output
    """
    from bristle.cli.console import stdout
    from bristle.cli.demo.files import KINDS, cleared
    from bristle.cli.demo.fit import fit_stage
    from bristle.cli.demo.record import record_stage
    from bristle.cli.demo.trace import trace_stage
    from bristle.cli.demo.watch import watch_stage

    cleared(out)
    console = stdout()
    console.rule("1  Fit")
    fit_stage(out, console)
    console.rule("2  Record")
    recorded = record_stage(out, console.print)
    console.rule("3  Trace")
    traced = trace_stage(recorded, out, console)
    console.rule("4  Watch")
    watched = watch_stage(traced, out, console.print)
    console.rule()
    console.print(
        f"Alarm after {watched.alarm_s:.1f} s, {'not named' if watched.fault is None else f'named {watched.fault}'}"
    )
    for name, files in KINDS.items():
        console.print(f"{name:11} {', '.join(str(out / file) for file in files)}")
    console.print(watched.false_alarms.plain)
