"""`bristle export`: a model or a recording for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    source: Annotated[str, typer.Argument(help="Model (model.json) or recording (.h5); bundled:NAME works too.")],
    to: Annotated[str, typer.Option(help="A model: c, casadi or fmu. A recording: parquet or matlab.")],
    out: Annotated[
        Path | None, typer.Option(help="Write here; the name of the source with another ending when not given.")
    ] = None,
    hold: Annotated[
        bool, typer.Option("--hold", help="C source: the force is held during a step, as a converter does.")
    ] = False,
    longest_step: Annotated[float, typer.Option(help="C source and unit: longest sub-step [s].")] = 5e-5,
    sub_steps: Annotated[int, typer.Option(help="CasADi function: equal parts of a step.")] = 1,
) -> None:
    """Make C source, a CasADi function or a functional mock-up unit of a model, or a table of a recording.

    Each runs without Bristle. A table holds all of a recording: bristle import makes the same recording of it.

    Example: bristle export model.json --to c --out valve.c
    """
    import bristle as br
    from bristle.cli.console import writable
    from bristle.cli.output.manner import answer, say
    from bristle.cli.output.working import working

    writable(out)
    export = br.export  # loading takes longer than most exports, and a refusal is one line
    with working("exporting"):
        files = export(source, to, out, hold=hold, longest_step=longest_step, sub_steps=sub_steps)  # type: ignore[arg-type]
    answer({"to": to, "files": [str(path) for path in files]})
    say(f"wrote {' and '.join(str(path) for path in files)}")
