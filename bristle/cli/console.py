"""What commands share: reading options, and a fit in words and tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bristle.cli.output.tables import words_table
from recordings import BadInput, BadParameter

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

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


def named_columns(text: str | None) -> dict[str, str]:
    """``SP=a,PV=b`` as a dictionary. Raises BadInput for anything else."""
    found = {}
    for item in (text or "").split(",") if text else ():
        name, equals, column = item.partition("=")
        if not equals or not column.strip():
            raise BadParameter("columns", item, "it is not NAME=COLUMN", "write for example SP=set,PV=flow,OP=valve")
        found[name.strip()] = column.strip()
    return found


def writable(path: Path | None) -> None:
    """Refuse an output path early, before the long work. Raises BadInput."""
    if path is None:
        return
    if not path.parent.is_dir():
        raise BadInput(str(path), f"there is no folder {path.parent}", "create it or give another path")
    if path.is_dir():
        raise BadInput(str(path), "it is a directory", "name one file inside it")


def model_words(model: ValveModel) -> str:
    """A model file in words: effects, parameters, noise, errors, what it was fitted to and what its repeats say."""
    lines = [f"valve model: {', '.join(model.effects)}"]
    for name, p in model.parameters.items():
        known = "given" if p.std is None else f"± {p.std:.2g}"
        lines.append(f"  {name:14} {p.value:12.6g} {p.unit:6} {known:12} {p.status}{f', {p.note}' if p.note else ''}")
    lines += [f"noise: {', '.join(f'{name} {value:.3g}' for name, value in model.noise.items() if value is not None)}"]
    for kind, error in model.error.items():
        if error:
            lines.append(f"free-run error, {kind}: {', '.join(f'{k} {v:.4g}' for k, v in error.items())}")
    lines += [f"fitted to {f.file} ({f.samples} samples, sha256 {f.sha256[:12]}...)" for f in model.fitted_to]
    repeats = model.quality.get("repeats")
    said = repeats.get("sentences") if isinstance(repeats, dict) else None
    lines += [str(sentence) for sentence in said] if isinstance(said, list) else []
    return "\n".join(lines)


def parameter_table(found: Identification, truth: dict[str, float] | None = None) -> Table:
    """The fitted parameters as a table, beside the truth where it is known."""
    heads = ("parameter", "value", "± std", "± repeats", "unit", "status", *(("truth", "error") if truth else ()))
    rows = []
    for name, p in found.model.parameters.items():
        std = "" if p.std is None else f"{p.std:.2g}"
        between = found.repeats.spread_of(name) if found.repeats else ""
        row = [name, f"{p.value:.6g}", std, between, p.unit, p.status]
        if truth:
            known = truth.get(name)
            row += (
                ["", ""]
                if known is None
                else [f"{known:.6g}", f"{100 * (p.value / known - 1):+.2f} %" if known else ""]
            )
        rows.append(row)
    return words_table(heads, rows, title="Identified valve", right=("value", "± std", "± repeats", "truth", "error"))


def print_identification(console: Console, found: Identification) -> None:
    """Everything a fit has to say: parameters, noise, errors, advice, and repeats and cross-check where asked for."""
    console.print(parameter_table(found), soft_wrap=False)
    noise = found.model.noise
    console.print(
        f"estimator: {found.fit.estimator}; noise of the position {1e6 * (noise['position_m'] or 0.0):.3g} µm, "
        f"of the force {noise['force_N'] or 0.0:.3g} N"
    )
    print_errors(console, found.model)
    for sentence in (*found.advice, *(found.repeats.sentences() if found.repeats else ())):
        console.print(sentence)
    print_crosscheck(console, found.crosscheck)


def print_crosscheck(console: Console, check: Crosscheck | None) -> None:
    """The cross-check row by row and in a sentence, where it was asked for."""
    if check is None:
        return
    if check.rows:
        console.print(crosscheck_table(check), soft_wrap=False)
    console.print(check.sentence)


def crosscheck_table(check: Crosscheck) -> Table:
    """The cross-check, row by row."""
    rows = []
    for row in check.rows:
        verdict = ("agrees" if row.agrees else "differs") if row.counts else "informs only"
        values = ((row.fitted, row.fitted_half), (row.regressed, row.regressed_half))
        shown = (f"{value:.4g} ± {half:.1g}" for value, half in values)
        rows.append((f"{row.name} [{row.unit}]", *shown, f"{row.allowed:.2g}", verdict))
    title = "Cross-check by sparse regression (pysindy), ± 90 %"
    heads = ("quantity", "fit", "regression", "allowed", "")
    return words_table(heads, rows, title=title, right=("fit", "regression", "allowed"))


FAR = 3.0
"""Residual, in noise levels, from which a fit is said to lack something."""


def print_errors(console: Console, model: ValveModel) -> None:
    """The free-run errors of a model, a line each, and a word on a residual that is more than noise."""
    for kind, error in model.error.items():
        if error:
            console.print(f"free-run error, {kind}: " + ", ".join(f"{k} {v:.4g}" for k, v in error.items()))
    over = float(model.quality.get("residual_over_noise", 1.0))
    if over > FAR:
        is_widened = model.quality.get("outcome", "converged") == "converged"
        said = "the model lacks something" + (", and the standard deviations are widened for it" if is_widened else "")
        console.print(f"the residual is {over:.3g} times the noise: {said}")
