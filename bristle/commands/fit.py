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
    crosscheck: Annotated[bool, typer.Option(help="Cross-check with pysindy.")] = True,
) -> None:
    """Fit the LuGre friction parameters and the spring of a valve to recordings.

    Example: bristle fit bundled:mixed --out model.json --report fit.html
    """
    from bristle._console import (
        assignments,
        crosscheck_table,
        load,
        parameter_table,
        print_errors,
        stdout,
        working,
        writable,
    )
    from bristle._fitting import checked_causality, checked_estimator, free_parameters, with_area, without_effects
    from identification import Outcome, identify
    from identification import profile as profile_of
    from recordings import NegativeAnswer

    for path in (out, report):
        writable(path)
    held = without_effects(without or []) | assignments(given or [], "--given")
    profiled = free_parameters(profile or [], held)
    read, others = (with_area(load(paths), area) for paths in (recordings, holdout or []))
    with working("fitting"):
        found = identify(
            read, holdout=others, given=held, causality=checked_causality(causality), hold=hold, check=crosscheck,
            estimator=checked_estimator(estimator),
        )  # fmt: skip
    console = stdout()
    console.print(parameter_table(found))
    noise = found.model.noise
    console.print(
        f"estimator: {found.fit.estimator}; noise of the position {1e6 * (noise['position_m'] or 0.0):.3g} µm, "
        f"of the force {noise['force_N'] or 0.0:.3g} N"
    )
    print_errors(console, found.model)
    for name in profiled:
        p = profile_of(found.fit, found.uncertainty, name)
        low, high = (f"{x:.6g}" if x is not None else "(no end found)" for x in (p.lower, p.upper))
        console.print(f"profile of {name}: 90 % interval from {low} to {high}")
    for sentence in found.advice:
        console.print(sentence)
    if found.crosscheck:
        console.print(crosscheck_table(found.crosscheck))
        console.print(found.crosscheck.sentence)
    elif crosscheck:
        console.print("no cross-check: these recordings show too little sliding for one")
    if out:
        found.model.write(out)
    if report:
        from identification.report import write_report

        write_report(report, found)
    if found.fit.outcome is not Outcome.CONVERGED:
        raise NegativeAnswer(found.fit.outcome.value)
    if found.crosscheck and not found.crosscheck.agrees:
        raise NegativeAnswer(found.crosscheck.sentence)
