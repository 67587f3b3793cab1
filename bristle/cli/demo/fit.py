"""The demo identifies the bundled valve, and compares with the truth."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from bristle.cli.console import parameter_table, print_crosscheck, print_errors
from bristle.cli.output.working import working
from identification import identify
from recordings import NegativeAnswer, bundled, bundled_path, read_truth

NAMES = ("step", "sine")


def fit_stage(out: Path, console: Console) -> None:
    """Fit, cross-check, model and report. Raises NegativeAnswer when the cross-check does not agree."""
    console.print(f"Fitting bundled recordings {' and '.join(NAMES)}; 'mixed' is held out. No starting values.")
    with working("fitting", staged=True) as progress:
        found = identify([bundled(name) for name in NAMES], holdout=[bundled("mixed")], progress=progress)
    truth = {k: float(v) for k, v in read_truth(bundled_path("step")).items() if k in found.model.parameters}
    console.print(parameter_table(found, truth), soft_wrap=False)
    print_errors(console, found.model)
    print_crosscheck(console, found.crosscheck)
    found.write(out / "model.json")
    found.report(out / "report.html")
    if not (found.crosscheck and found.crosscheck.decides and found.crosscheck.agrees):
        raise NegativeAnswer("the cross-check does not confirm the fit")
