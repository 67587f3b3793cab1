"""`bristle fit`: LuGre friction and spring from recordings, without start values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    recordings: Annotated[
        list[str], typer.Argument(help="Recordings (.h5), fitted together; bundled:NAME for an example.")
    ],
    out: Annotated[Path | None, typer.Option(help="Write the model here (model.json).")] = None,
    holdout: Annotated[
        list[str] | None, typer.Option(help="Recording that only judges the fit; repeat for more.")
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
    given: Annotated[list[str] | None, typer.Option(help="Hold a parameter: mass.m=2.1 (SI units).")] = None,
    without: Annotated[list[str] | None, typer.Option(help="Leave out: 'spring' for a plant without one.")] = None,
    causality: Annotated[
        str | None, typer.Option(help="'force' or 'motion'; the roles in the file decide otherwise.")
    ] = None,
    area: Annotated[float | None, typer.Option(help="Diaphragm area [m2], to turn pressure into force.")] = None,
    hold: Annotated[bool, typer.Option(help="The force is held between samples (a converter's output).")] = False,
    profile: Annotated[list[str] | None, typer.Option(help="Profile likelihood of this parameter as well.")] = None,
    estimator: Annotated[
        str, typer.Option(help="'auto', 'output-error' (exact force) or 'noise-aware' (noisy force).")
    ] = "auto",
    bootstrap: Annotated[
        int, typer.Option(help="Intervals from this many refits of simulated twins (0: from the linearised model).")
    ] = 0,
    crosscheck: Annotated[bool, typer.Option(help="Cross-check with pysindy.")] = True,
) -> None:
    """Fit the LuGre friction parameters and the spring of a valve to recordings.

    Example: bristle fit bundled:mixed --out model.json --report fit.html
    """
    from bristle.cli.console import assignments, load, print_identification, stdout, working, writable
    from bristle.cli.fitting import (
        checked_causality,
        checked_estimator,
        counted,
        free_parameters,
        print_profiles,
        with_area,
        without_effects,
    )
    from identification import Outcome, identify
    from recordings import NegativeAnswer

    for path in (out, report):
        writable(path)
    held = without_effects(without or []) | assignments(given or [], "--given")
    profiled = free_parameters(profile or [], held)
    read, others = (with_area(load(paths), area) for paths in (recordings, holdout or []))
    with working("fitting") as status:
        found = identify(
            read, holdout=others, given=held, causality=checked_causality(causality), hold=hold, check=crosscheck,
            estimator=checked_estimator(estimator), bootstrap=bootstrap, progress=counted(status),
        )  # fmt: skip
    console = stdout()
    print_identification(console, found, crosscheck=crosscheck)
    print_profiles(console, found, profiled)
    if out:
        found.model.write(out)
    if report:
        from identification.report import write_report

        write_report(report, found)
    if found.fit.outcome is not Outcome.CONVERGED:
        raise NegativeAnswer(found.fit.outcome.value)
    if found.crosscheck and not found.crosscheck.agrees:
        raise NegativeAnswer(found.crosscheck.sentence)
