"""`bristle demo`: the main job end to end, from a bundled example to a valve that is watched."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    out: Annotated[Path, typer.Option(help="Folder for recordings, models, reports and events.")] = Path("demo-output"),
    keep: Annotated[bool, typer.Option("--keep", help="Leave valve, monitor and page running until Ctrl-C.")] = False,
) -> None:
    """Fit a bundled valve; record another over Modbus, trace what its model lacks, watch it, and find a fault.

    The second valve is simulated, in a process of its own on loopback, with an effect that the model does not have.
    Takes three to four minutes on two cores, longer on a busy machine; most of it is the trace, which has ten at most.
    A live page shows how it is watched; it ends with the demo unless --keep is given.

    Example: bristle demo --out demo-output --keep
    """
    from bristle.cli.demo.files import KINDS, cleared
    from bristle.cli.demo.fit import fit_stage
    from bristle.cli.demo.record import record_stage
    from bristle.cli.demo.trace import trace_stage
    from bristle.cli.demo.watch import DemoWatch, watch_stage
    from bristle.cli.output.manner import answer, stdout

    cleared(out)
    console = stdout()
    console.rule("1  Fit")
    fit_stage(out, console)
    console.rule("2  Record")
    recorded = record_stage(out, console.print)
    console.rule("3  Trace")
    traced = trace_stage(recorded, out, console)
    console.rule("4  Watch")

    def ending(watched: DemoWatch) -> None:
        console.rule()
        answer({
            "alarm_s": watched.alarm_s, "fault": watched.fault, "false_alarms": watched.false_alarms.plain,
            "files": {name: [out / file for file in files] for name, files in KINDS.items()}, "page": watched.page,
        })  # fmt: skip
        named = "not named" if watched.fault is None else f"named {watched.fault}"
        console.print(f"Alarm after {watched.alarm_s:.1f} s, {named}")
        for name, files in KINDS.items():
            console.print(f"{name:11} {', '.join(str(out / file) for file in files)}")
        console.print(f"{'page':11} {watched.page}{'' if keep else ' (it ends now; with --keep it stays)'}")
        console.print(watched.false_alarms.plain)

    watch_stage(traced, out, console.print, ending, keep)
