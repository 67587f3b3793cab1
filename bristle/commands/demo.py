"""`bristle demo`: the main job end to end on a bundled example."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    out: Annotated[Path, typer.Option(help="Folder for model and report.")] = Path("demo-output"),
) -> None:
    """Identify a valve from bundled step and sine recordings without a start value, and compare with the truth.

    Example: bristle demo --out demo-output
    """
    from bristle._console import crosscheck_table, load, parameter_table, print_errors, stdout
    from identification import identify
    from identification.report import write_report
    from recordings import BadInput, NegativeAnswer, bundled_path, read_truth

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(str(out), f"the folder cannot be made ({error.strerror})", "give another --out") from error
    names = ("step", "sine")
    console = stdout()
    console.print(f"Fitting bundled recordings {' and '.join(names)}; 'mixed' is held out to judge. No start values.")
    found = identify(load([f"bundled:{n}" for n in names]), holdout=load(["bundled:mixed"]))
    truth = {k: float(v) for k, v in read_truth(bundled_path("step")).items() if k in found.model.parameters}
    console.print(parameter_table(found, truth))
    print_errors(console, found.model)
    if found.crosscheck:
        console.print(crosscheck_table(found.crosscheck))
        console.print(found.crosscheck.sentence)
    model, page = out / "model.json", out / "report.html"
    found.model.write(model)
    write_report(page, found)
    console.print(f"model   {model}\nreport  {page}")
    if not found.crosscheck or not found.crosscheck.agrees:
        raise NegativeAnswer("the cross-check does not confirm the fit")
