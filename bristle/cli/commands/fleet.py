"""`bristle fleet`: the same work on every valve of a plant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    what: Annotated[str, typer.Argument(help="fit, trace, assess or test.")],
    source: Annotated[
        str, typer.Argument(help="Folder of recordings, or a table (CSV, Parquet) with valve and recordings; or a URL.")
    ],
    out: Annotated[Path, typer.Option(help="The table of results (.parquet); what is there is not done again.")],
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler, tcp://HOST:8786; processes of this machine otherwise.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes of this machine, one a core otherwise; 0: none.", min=0, max=4096)
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write the page of the fleet here (HTML).")] = None,
    pages: Annotated[Path | None, typer.Option(help="Folder for a page of each valve, which workers share.")] = None,
    rate: Annotated[
        float, typer.Option(help="False-discovery rate of outliers on the page.", min=1e-6, max=0.5)
    ] = 0.05,
    area: Annotated[float | None, typer.Option(help="fit, trace: diaphragm area [m2].")] = None,
    given: Annotated[list[str] | None, typer.Option(help="fit, trace: hold a parameter, mass.m=2.1 (SI).")] = None,
    without: Annotated[list[str] | None, typer.Option(help="fit, trace: leave out 'spring'.")] = None,
    budget: Annotated[float | None, typer.Option(help="trace: seconds for each valve.", min=1.0)] = None,
    loop: Annotated[str | None, typer.Option(help="assess: flow, pressure, level or temperature.")] = None,
    columns: Annotated[str | None, typer.Option(help="assess: SP=A,PV=B,OP=C,TIME=T with names of columns.")] = None,
    kind: Annotated[str | None, typer.Option(help="test: step, deadband, signature or partial-stroke.")] = None,
) -> None:
    """Fit, trace, assess or test every valve of a folder or a table, on all cores or on a Dask cluster.

    Example: bristle fleet fit recordings --out results.parquet --report fleet.html
    """
    from bristle.cli.console import assignments, named_columns, writable
    from bristle.cli.fleets import needed, summary, told
    from bristle.cli.output.manner import answer, say
    from bristle.cli.output.working import working
    from recordings import NegativeAnswer

    needed()
    from bristle.fleet import run_fleet, write_fleet_page

    for path in (out, report):
        writable(path)
    options = {
        "area": area, "given": assignments(given or [], "--given"), "without": without, "budget": budget, "loop": loop,
        "columns": named_columns(columns), "kind": kind,
    }  # fmt: skip
    with working(f"fleet {what}", staged=True) as progress:
        rows = run_fleet(
            what, source, out, options=options, scheduler=scheduler, workers=workers, pages=pages,
            progress=progress, tell=lambda row: say(told(row)),
        )  # fmt: skip
    if report:
        write_fleet_page(report, what, rows, pages, rate)
    say(summary(rows))
    answer({"results": out, "rows": rows})
    if not any(row["state"] == "done" for row in rows):
        raise NegativeAnswer("not one recording gave a result; the table says why of each")
