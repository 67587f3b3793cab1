"""`bristle trace`: what the model of a valve lacks, found in recordings, added, and judged on held-out data."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bristle.cli.tracing import BUDGET_S


def command(
    recordings: Annotated[list[str], typer.Argument(help="Recordings (.h5), traced together; bundled:NAME works too.")],
    out: Annotated[Path | None, typer.Option(help="Write the answer here (trace.json).")] = None,
    model_out: Annotated[Path | None, typer.Option(help="Write the model with the added effects here.")] = None,
    holdout: Annotated[
        list[str] | None, typer.Option(help="Recording that only judges; without any, the last quarter of each does.")
    ] = None,
    report_on: Annotated[
        list[str] | None,
        typer.Option(help="Recording for the errors before and after; without any, the last quarter of what judges."),
    ] = None,
    budget: Annotated[float, typer.Option(help="Answer with the best so far after so many seconds.")] = BUDGET_S,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
    given: Annotated[list[str] | None, typer.Option(help="Hold a parameter: spring.F0=310 (SI units).")] = None,
    without: Annotated[list[str] | None, typer.Option(help="Leave out: 'spring' for a plant without one.")] = None,
    area: Annotated[float | None, typer.Option(help="Diaphragm area [m2], to turn pressure into force.")] = None,
    hold: Annotated[bool, typer.Option(help="The force is held between samples (a converter's output).")] = False,
) -> None:
    """Find the effect that a valve shows and the model of spring and friction lacks, or say that nothing is missing.

    Example: bristle trace bundled:step bundled:sine --holdout bundled:mixed --out trace.json --model-out model.json
    """
    import bristle as br
    from bristle.cli.console import assignments, writable
    from bristle.cli.output.manner import answer, stdout
    from bristle.cli.output.working import working
    from bristle.cli.tracing import candidate_table, error_lines

    for path in (out, model_out, report):
        writable(path)
    held = assignments(given or [], "--given")
    with working("tracing", staged=True, budget=budget) as progress:
        found = br.trace(
            recordings,
            holdout=holdout or (),
            report_on=report_on or (),
            budget=budget,
            given=held,
            without=without or (),
            area=area,
            hold=hold,
            progress=progress,
        )
    answer(found.as_json())
    console = stdout()
    console.print(f"verdict: {found.verdict}")
    for sentence in found.sentences():
        console.print(sentence)
    console.print(candidate_table(found), soft_wrap=False)
    for line in error_lines(found):
        console.print(line)
    if out:
        found.write(out)
    if model_out:
        found.model.write(model_out)
    if report:
        found.report(report)
