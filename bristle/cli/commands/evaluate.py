"""`bristle evaluate`: detectors against the benchmark's scenarios, tables and a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option


def command(
    out: Annotated[Path, Option(help="Folder for tables, page and results; made when it is not there.")],
    detectors: Annotated[str, Option(help="Detectors, separated by commas; all of them otherwise.")] = "all",
    scenarios: Annotated[str, Option(help="Scenarios, separated by commas; all 44 otherwise.")] = "all",
    variants: Annotated[str, Option(help="play-1, lugre-1, lugre-10, lugre-100, lugre-400; or all.")] = "all",
    seeds: Annotated[
        int | None, Option(help="Trials of each scenario of play-1, of a day-long one at most 3; 5 otherwise.", min=1)
    ] = None,
    false_alarms: Annotated[
        float | None, Option(help="Stated rate of false alarms, per hour; 0.01 otherwise, 0.5 with --smoke.")
    ] = None,
    smoke: Annotated[
        bool, Option("--smoke", help="Few fault-free hours, three scenarios, one trial: quick, not to be relied on.")
    ] = False,
    plant: Annotated[
        Path | None, Option(help="Measured hour of actuator 3 (MATLAB file), on which alarms are counted, too.")
    ] = None,
    workers: Annotated[int, Option(help="Processes; 0 for one per core.", min=0)] = 0,
) -> None:
    """Run detectors on the benchmark's scenarios, all at one rate of false alarms, and write what they saw.

    An interrupted run goes on where it stopped when it is started again with the same options.

    Example: bristle evaluate --detectors bank,kalman --scenarios f4-incipient,f11-abrupt-big --out compared
    """
    from bristle.cli.evaluating import plan_of, reported, results, summary
    from bristle.cli.output.manner import answer, stdout
    from recordings import save_json

    plan = plan_of(detectors, scenarios, variants, seeds, false_alarms, smoke)
    outcome, files = reported(plan, out, workers, plant)
    told = results(outcome, files)
    save_json(out / "evaluation.json", told)
    answer(told)
    console = stdout()
    console.print(summary(outcome), soft_wrap=False)
    console.print(f"wrote {len(files)} files to {out}, among them evaluation.md and evaluation.html")
