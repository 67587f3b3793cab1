"""What a fit or a trace says in a few lines: at the prompt of an interpreter, and as a table in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.result import FitResult
    from identification.tracing.result import TraceResult
    from simulator import ValveModel

BEST = 5
"""Candidates of a trace that its table shows."""


def fit_text(found: FitResult) -> str:
    """A fit in three lines."""
    values = ", ".join(f"{name} {value:.4g}" for name, value in found.values.items())
    return f"<Identification of {_names(found)}: {_outcome(found)}\n {values}\n {_errors(found.model)}>"


def fit_html(found: FitResult) -> str:
    """A fit as a table: every parameter with its standard deviation, that between repeats, unit and status."""
    repeats = found.repeats
    rows = [
        (
            name, f"{p.value:.6g}", "" if p.std is None else f"{p.std:.2g}",
            *([] if repeats is None else [repeats.spread_of(name)]), p.unit, p.status,
        )
        for name, p in found.model.parameters.items()
    ]  # fmt: skip
    caption = f"{_names(found)}: {_outcome(found)}. {_errors(found.model)}"
    heads = ("parameter", "value", "± std", *([] if repeats is None else ["± repeats"]), "unit", "status")
    return html_table(caption, heads, rows)


def trace_text(found: TraceResult) -> str:
    """A trace in three lines."""
    return f"<Trace of {_names(found.final)}: {found.verdict}\n {_said(found)}\n {_change(found)}>"


def trace_html(found: TraceResult) -> str:
    """A trace as a table: the best candidates, and what became of each."""
    rows = [
        (c.effect, f"{c.gain:.4g}", _number(found.holdout_rmse.get(c.effect)), "accepted" if c.accepted else c.why)
        for c in found.candidates[:BEST]
    ]
    heads = ("effect", "gain", f"held-out rmse [{found.unit}]", "outcome")
    return html_table(f"{found.verdict}. {_said(found)} {_change(found)}", heads, rows)


def _names(found: FitResult) -> str:
    return ", ".join(run.name for run in found.trajectories)


def _outcome(found: FitResult) -> str:
    return "converged" if found.converged else found.fit.outcome.value


def _errors(model: ValveModel) -> str:
    """The free-run errors of a model."""
    kinds = (f"{kind} {_rmse(error)}" for kind, error in model.error.items() if error)
    return f"free-run error: {', '.join(kinds) or 'none is known'}"


def _rmse(error: Mapping[str, float]) -> str:
    return ", ".join(f"{value:.3g} {name.removeprefix('rmse_')}" for name, value in error.items() if "rmse_" in name)


def _said(found: TraceResult) -> str:
    """The first sentence of the answer."""
    return next(iter(found.sentences()), "")


def _change(found: TraceResult) -> str:
    sides = (_number((found.error[side]["holdout"] or {}).get(f"rmse_{found.unit}")) for side in ("before", "after"))
    before, after = sides
    return f"held-out error: {before or '?'} {found.unit} before, {after or '?'} {found.unit} after"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def html_table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A small table for a notebook, without style or script; every text is escaped."""
    head = "".join(f"<th>{escape(word)}</th>" for word in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(word)}</td>' for word in row)}</tr>" for row in rows)
    return f"<table><caption>{escape(caption)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
