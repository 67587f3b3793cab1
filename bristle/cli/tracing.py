"""A trace on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bristle.cli.output.tables import words_table

if TYPE_CHECKING:
    from rich.table import Table

    from identification import Trace

SHOWN = 8
"""Candidates of a table."""
BUDGET_S = 120.0
"""Time of a trace unless another is asked for [s]."""


def candidate_table(found: Trace) -> Table:
    """The best candidates of the first round, with what became of them."""
    rows = []
    for c in found.candidates[:SHOWN]:
        rmse = found.holdout_rmse.get(c.effect)
        rows.append((
            c.effect, f"{c.gain:.4g}", "" if c.held_out is None else f"{c.held_out.t:.1f}",
            "" if rmse is None else f"{rmse:.3g}", "accepted" if c.accepted else c.why,
        ))  # fmt: skip
    return words_table(("effect", "gain", "held-out t", f"held-out rmse [{found.unit}]", "outcome"), rows)


def error_lines(found: Trace) -> Iterator[str]:
    """The free-run errors before, and after where an effect was added."""
    error = found.error
    for side in ("before", "after") if found.effects_added else ("before",):
        for where, value in error[side].items():
            if value and "rmse_m" in value:
                yield f"free-run error {side}, {where}: {value['rmse_m']:.3g} m (nrmse {value.get('nrmse', 0):.3g})"
            if value and "rmse_N" in value:
                yield f"force error {side}, {where}: {value['rmse_N']:.3g} N (nrmse {value['nrmse_N']:.3g})"
    yield f"noise floor: {error[f'noise_floor_{found.unit}']:.3g} {found.unit}"


def trace_words(file: Path) -> str:
    """A `trace.json` in words. Raises BadInput when it is none."""
    from recordings import BadInput, read_small_json

    remedy = "write one with 'bristle trace --out'"
    content = read_small_json(file, remedy)
    try:
        return "\n".join(_told(content))
    except (ArithmeticError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise BadInput(str(file), f"it is no trace ({repr(error)[:120]})", remedy) from None


def _told(content: dict[str, Any]) -> Iterator[str]:
    yield f"trace: verdict {content['verdict']}"
    if content["effects_added"]:
        yield f"effects added: {', '.join(content['effects_added'])}"
    if content.get("same_class"):
        yield f"cannot be told from: {', '.join(content['same_class'])}"
    if content["unlisted"]:
        yield f"left: {content['unlisted']['description']}; {content['unlisted']['where']}"
    for side in ("before", "after"):
        for where, error in content["error"][side].items():
            known = [unit for unit in ("N", "m") if f"rmse_{unit}" in (error or {})]
            if known:
                yield f"error {side}, {where}: {error[f'rmse_{known[0]}']:.3g} {known[0]}"
    yield "candidates:"
    yield from (f"  {c['effect']:28} {c['why']}" for c in content["candidates"])
    if not content.get("complete", True):
        yield f"the budget of time was over; left out: {', '.join(content['not_tried'])}"
