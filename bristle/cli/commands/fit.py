"""`bristle fit`: LuGre friction and spring from recordings, without starting values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

if TYPE_CHECKING:
    from identification import Estimator, Order
    from simulator import Causality


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
    order: Annotated[
        str, typer.Option(help="'auto', or what the sampling resolves: 'full', 'damped' or 'static'.")
    ] = "auto",
    prior: Annotated[
        list[str] | None, typer.Option(help="What is known of a parameter: mass.m=2.1+-0.2 (SI units).")
    ] = None,
    constraint: Annotated[
        list[str] | None, typer.Option(help="What the fit must keep to: lugre.fs>=1.05*lugre.fc (SI units).")
    ] = None,
    bootstrap: Annotated[
        int,
        typer.Option(help="Intervals from so many refits of simulated recordings (0: by linearisation)."),
    ] = 0,
    repeats: Annotated[
        bool, typer.Option("--repeats", help="The recordings repeat one test: say how far the fits to each differ.")
    ] = False,
    budget: Annotated[
        float | None, typer.Option(help="End the fit after so many seconds, with the values so far.")
    ] = None,
    crosscheck: Annotated[bool, typer.Option(help="Cross-check with pysindy.")] = True,
    friction: Annotated[
        list[str] | None, typer.Option(help="Fit this friction model to the measured force; repeat for more.")
    ] = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="Compare friction models by held-out error: all, or those of --friction.")
    ] = False,
    free_run: Annotated[
        bool, typer.Option("--free-run", help="Compare by where the recorded force moves the stem, not by the force.")
    ] = False,
) -> None:
    """Fit the LuGre friction parameters and the spring of a valve to recordings.

    Example: bristle fit bundled:mixed --out model.json --report fit.html

    With --friction or --compare the models of friction are fitted to the force that the recorded motion takes, and
    with --free-run to the motion that the recorded force leads to.
    """
    import bristle as br
    from bristle.cli.console import assignments, print_identification, writable
    from bristle.cli.fitting import compare_models, print_profiles, priors, profiled, refuse_others
    from bristle.cli.output.manner import answer, stdout
    from bristle.cli.output.working import working
    from identification import without_effects

    for path in (out, report):
        writable(path)
    if friction or compare or free_run:
        whole_valve = {"--prior": prior, "--constraint": constraint, "--profile": profile, "--bootstrap": bootstrap,
                       "--repeats": repeats}  # fmt: skip
        refuse_others(whole_valve | {"--budget": budget} | ({"--without": without} if free_run else {"--given": given}))
        compare_models(
            recordings, free_run=free_run, out=out, report=report, given=given, without=without,
            holdout=holdout or (), models=friction or (), area=area, hold=hold,
        )  # fmt: skip
        return
    held = without_effects(without or ()) | assignments(given or [], "--given")
    wanted = profiled(profile or (), held)
    seconds = float("inf") if budget is None else budget
    with working("fitting", staged=True, budget=seconds) as progress:
        found = br.fit(
            recordings, holdout=holdout or (), given=held, causality=cast("Causality | None", causality), area=area,
            hold=hold, estimator=cast("Estimator", estimator), order=cast("Order", order), priors=priors(prior or ()),
            constraints=constraint or (), bootstrap=bootstrap, repeats=repeats, crosscheck=crosscheck,
            budget=seconds, progress=progress,
        )  # fmt: skip
    answer(found.model.model_dump(mode="json"))
    console = stdout()
    print_identification(console, found)
    print_profiles(console, found, wanted)
    if out:
        found.write(out)
    if report:
        found.report(report)
    if not found.converged:
        raise br.NegativeAnswer(found.fit.outcome.value)
    if found.crosscheck and not found.crosscheck.agrees:
        raise br.NegativeAnswer(found.crosscheck.sentence)
