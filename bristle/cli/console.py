"""What commands share: reading options, and tables on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from recordings import BadInput, Progress

if TYPE_CHECKING:
    from rich.console import Console

    from identification import Crosscheck, Identification
    from simulator import ValveModel


def assignments(items: Sequence[str], option: str) -> dict[str, float]:
    """Options of the form NAME=NUMBER. Raises BadInput for anything else."""
    found = {}
    for item in items:
        name, equals, text = item.partition("=")
        try:
            found[name.strip()] = float(text)
        except ValueError:
            equals = ""
        if (
            not equals
            or found.get(name.strip()) in (float("inf"), float("-inf"))
            or found[name.strip()] != found[name.strip()]
        ):
            raise BadInput(f"{option} {item}", "it is not NAME=NUMBER", f"write for example {option} mass.m=2.1")
    return found


def writable(path: Path | None) -> None:
    """Refuse an output path early, before the long work. Raises BadInput."""
    if path is None:
        return
    if not path.parent.is_dir():
        raise BadInput(str(path), f"there is no folder {path.parent}", "create it or give another path")
    if path.is_dir():
        raise BadInput(str(path), "it is a directory", "name one file inside it")


def working(what: str) -> AbstractContextManager[object]:
    """A sign of life on a terminal while something takes its time; silent elsewhere."""
    from rich.console import Console

    console = Console(stderr=True)
    return console.status(what) if console.is_terminal else nullcontext()


def shown_on(status: object) -> Progress:
    """Progress on the sign of life that `working` gives: what is being done, and how much of it is."""
    from rich.status import Status

    def report(stage: str, done: int, total: int) -> None:
        if isinstance(status, Status):
            status.update(f"{stage}: {done} of {total}" if total else stage)

    return report


def stdout() -> Console:
    """The console for results."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=True)


def model_words(model: ValveModel) -> str:
    """A model file in words: effects, parameters, noise, errors and what it was fitted to."""
    lines = [f"valve model: {', '.join(model.effects)}"]
    for name, p in model.parameters.items():
        known = "given" if p.std is None else f"± {p.std:.2g}"
        lines.append(f"  {name:14} {p.value:12.6g} {p.unit:6} {known:12} {p.status}{f', {p.note}' if p.note else ''}")
    lines += [f"noise: {', '.join(f'{name} {value:.3g}' for name, value in model.noise.items() if value is not None)}"]
    for kind, error in model.error.items():
        if error:
            lines.append(f"free-run error, {kind}: {', '.join(f'{k} {v:.4g}' for k, v in error.items())}")
    lines += [f"fitted to {f.file} ({f.samples} samples, sha256 {f.sha256[:12]}...)" for f in model.fitted_to]
    return "\n".join(lines)


def parameter_table(found: Identification, truth: dict[str, float] | None = None) -> object:
    """The fitted parameters as a table, beside the truth where it is known."""
    from rich.table import Table

    table = Table(title="Identified valve", title_justify="left")
    for column in ("parameter", "value", "± std", "unit", "status", *(["truth", "error"] if truth else [])):
        table.add_column(column, justify="left" if column in ("parameter", "unit", "status") else "right")
    for name, p in found.model.parameters.items():
        std = "" if p.std is None else f"{p.std:.2g}"
        row = [name, f"{p.value:.6g}", std, p.unit, p.status]
        if truth:
            known = truth.get(name)
            row += (
                ["", ""]
                if known is None
                else [f"{known:.6g}", f"{100 * (p.value / known - 1):+.2f} %" if known else ""]
            )
        table.add_row(*row)
    return table


def print_identification(console: Console, found: Identification) -> None:
    """Everything a fit has to say: parameters, noise, errors, advice and the cross-check that was asked for."""
    console.print(parameter_table(found))
    noise = found.model.noise
    console.print(
        f"estimator: {found.fit.estimator}; noise of the position {1e6 * (noise['position_m'] or 0.0):.3g} µm, "
        f"of the force {noise['force_N'] or 0.0:.3g} N"
    )
    print_errors(console, found.model)
    for sentence in found.advice:
        console.print(sentence)
    print_crosscheck(console, found.crosscheck)


def print_crosscheck(console: Console, check: Crosscheck | None) -> None:
    """The cross-check row by row and in a sentence, where it was asked for."""
    if check is None:
        return
    if check.rows:
        console.print(crosscheck_table(check))
    console.print(check.sentence)


def crosscheck_table(check: Crosscheck) -> object:
    """The cross-check, row by row."""
    from rich.table import Table

    table = Table(title="Cross-check by sparse regression (pysindy), ± 90 %", title_justify="left")
    for column in ("quantity", "fit", "regression", "allowed", ""):
        words = column in ("quantity", "")
        table.add_column(column, justify="left" if words else "right", no_wrap=words)
    for row in check.rows:
        verdict = ("agrees" if row.agrees else "differs") if row.counts else "informs only"
        values = ((row.fitted, row.fitted_half), (row.regressed, row.regressed_half))
        shown = (f"{value:.4g} ± {half:.1g}" for value, half in values)
        table.add_row(f"{row.name} [{row.unit}]".replace("[", r"\["), *shown, f"{row.allowed:.2g}", verdict)
    return table


FAR = 3.0
"""Residual, in noise levels, from which a fit is said to lack something."""


def print_errors(console: Console, model: ValveModel) -> None:
    """The free-run errors of a model, a line each, and a word on a residual that is more than noise."""
    for kind, error in model.error.items():
        if error:
            console.print(f"free-run error, {kind}: " + ", ".join(f"{k} {v:.4g}" for k, v in error.items()))
    over = float(model.quality.get("residual_over_noise", 1.0))
    if over > FAR:
        said = "the model lacks something, and the standard deviations are widened for it"
        console.print(f"the residual is {over:.3g} times the noise: {said}")
