"""`bristle assess`: whether the valve of a control loop sticks, from SP, PV and OP."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    file: Annotated[str, typer.Argument(help="Historian data (CSV, TSV, MATLAB, Parquet) or a recording (.h5).")],
    loop: Annotated[str | None, typer.Option(help="flow, pressure, level or temperature.")] = None,
    columns: Annotated[
        str | None, typer.Option(help="SP=...,PV=...,OP=...,TIME=...; each with :UNIT if needed.")
    ] = None,
    valve: Annotated[
        str | None, typer.Option(help="For friction in N: stroke=0.02,K=5e4 (m, N/m) or area=0.0129,span=80 (m2, kPa).")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the answer here (assessment.json).")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
) -> None:
    """Say whether the valve of a loop sticks, and how much, or that these data cannot tell.

    Example: bristle assess loop.csv --loop flow --columns SP=FC7.SP,PV=FC7.PV,OP=FC7.OP:% --out assessment.json
    """
    import bristle as br
    from bristle.cli.console import assignments, named_columns, writable
    from bristle.cli.output.manner import present
    from bristle.cli.output.working import working

    for path in (out, report):
        writable(path)
    known = assignments(valve.split(","), "--valve") if valve else None
    with working("assessing", staged=True) as progress:
        found = br.assess(file, loop=loop, columns=named_columns(columns), valve=known, progress=progress)
    present(found, out, report)
