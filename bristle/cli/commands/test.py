"""`bristle test`: the standard valve tests from recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    recordings: Annotated[list[str], typer.Argument(help="Recordings of the test (.h5); bundled:NAME works too.")],
    kind: Annotated[str, typer.Option(help="step, deadband, signature or partial-stroke.")],
    reference: Annotated[Path | None, typer.Option(help="An earlier test.json of the same kind.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the result here (test.json).")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
) -> None:
    """Step response, dead band and resolution, signature or partial stroke of a valve, with intervals.

    Example: bristle test bundled:step --kind step --out test.json
    """
    import bristle as br
    from bristle.cli.console import writable
    from bristle.cli.output.manner import answer, stdout
    from bristle.cli.output.working import working
    from recordings import NegativeAnswer

    for path in (out, report):
        writable(path)
    with working("testing"):
        found = br.test(recordings, kind, reference=reference)
    answer(found.as_json())
    console = stdout()
    for line in found.lines():
        console.print(line, markup=False)
    if out:
        found.write(out)
    if report:
        found.report(report)
    if found.aborted:
        raise NegativeAnswer(f"the partial stroke failed: {'; '.join(found.aborted)}")
