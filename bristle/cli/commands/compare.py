"""`bristle compare`: what changed between two recordings, or two models, of one valve."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    before: Annotated[str, typer.Argument(help="Recording (.h5) or model (.json); bundled:NAME works too.")],
    after: Annotated[str, typer.Argument(help="The same of the same valve, later.")],
    out: Annotated[Path | None, typer.Option(help="Write the comparison here (compare.json).")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
    area: Annotated[float | None, typer.Option(help="Diaphragm area [m2], to turn pressure into force.")] = None,
    repeatability: Annotated[
        float, typer.Option(help="Share by which tests of an unchanged valve differ, such as 0.03.")
    ] = 0.0,
) -> None:
    """Say what changed between two tests of one valve, beyond noise and repeatability.

    Recordings need two strokes each way through the same travel: an ordinary step test of five strokes is enough.

    Example: bristle compare before.h5 after.h5 --out compare.json --report compare.html
    """
    import bristle as br
    from bristle.cli.comparing import quantity_table
    from bristle.cli.console import writable
    from bristle.cli.output.manner import answer, stdout
    from bristle.cli.output.working import working

    for path in (out, report):
        writable(path)
    with working("comparing", staged=True) as progress:
        found = br.compare(before, after, area=area, repeatability=repeatability, progress=progress)
    answer(found.as_json())
    console = stdout()
    for sentence in found.sentences():
        console.print(sentence)
    console.print(quantity_table(found), soft_wrap=False)
    if out:
        found.write(out)
    if report:
        found.report(report)
