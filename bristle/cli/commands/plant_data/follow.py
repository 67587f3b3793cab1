"""`bristle follow`: a valve through the years."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    recordings: Annotated[list[str], typer.Argument(help="Dated recordings (.h5) of one valve, or folders of them.")],
    limit: Annotated[
        list[str] | None,
        typer.Option(help="fc=200 (N), K=5e4 (N/m), dead_band=3 (%) or leak=2 (% of the largest flow)."),
    ] = None,
    area: Annotated[float | None, typer.Option(help="Diaphragm area [m2], to turn pressure into force.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the answer here (follow.json).")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
) -> None:
    """Follow friction, spring rate, dead band and leak over months of natural movement, and say when they cross limits.

    Example: bristle follow recordings/ --limit fc=200 --out follow.json --report page.html
    """
    import bristle as br
    from bristle.cli.console import assignments, writable
    from bristle.cli.output.manner import present
    from bristle.cli.output.working import working

    for path in (out, report):
        writable(path)
    limits = assignments(limit or [], "--limit")
    with working("following", staged=True) as progress:
        found = br.follow(recordings, limits=limits, area=area, progress=progress)
    present(found, out, report)
