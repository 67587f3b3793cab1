"""`bristle test`: the standard valve tests from recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    kind: Annotated[str, typer.Option(help="step, deadband, signature, partial-stroke or error-band.")],
    recordings: Annotated[
        list[str] | None, typer.Argument(help="Recordings of the test (.h5); bundled:NAME works too.")
    ] = None,
    simulate: Annotated[bool, typer.Option(help="Run the test on a simulated valve behind its positioner.")] = False,
    model: Annotated[
        Path | None, typer.Option(help="The simulated valve (model.json); without one, a random one.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the random valve and of the noise.")] = 0,
    reference: Annotated[Path | None, typer.Option(help="An earlier test.json of the same kind.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the result here (test.json).")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
) -> None:
    """Step response, dead band and resolution, signature, partial stroke or dynamic error band, with intervals.

    Example: bristle test bundled:step --kind step --out test.json; bristle test --simulate --kind error-band
    """
    import bristle as br
    from bristle.cli.console import writable
    from bristle.cli.output.manner import present
    from bristle.cli.output.working import working
    from recordings import BadParameter, NegativeAnswer

    for path in (out, report):
        writable(path)
    if simulate == bool(recordings):
        given = "with recordings" if simulate else "not given, and no recording either"
        raise BadParameter("simulate", given, "a test needs recordings or --simulate", "give one of the two")
    with working("testing", staged=True) as progress:
        tested = [br.simulate_test(kind, model=model, seed=seed, progress=progress)] if simulate else recordings or []
        found = br.test(tested, kind, reference=reference, progress=progress)
    present(found, out, report)
    if found.aborted:
        raise NegativeAnswer(f"the partial stroke failed: {'; '.join(found.aborted)}")
