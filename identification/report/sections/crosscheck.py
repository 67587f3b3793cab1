"""The second opinion: what sparse regression finds in the measured force."""

from __future__ import annotations

from typing import Any

from identification.report.section import Section
from identification.report.wording.numbers import NARROW, number, percent
from identification.result import FitResult
from identification.sparse_regression.crosscheck import ComparedQuantity


def crosscheck(identification: FitResult) -> Section:
    """The cross-check section; a sentence why there is none where there is none."""
    check = identification.crosscheck
    if check is None:
        return Section("crosscheck", "Cross-check", {"check": None, "why": "There is no cross-check: none was made."})
    sentence = f"{check.sentence[0].upper()}{check.sentence[1:]}."
    if not check.decides:
        why = f"{sentence} Long strokes in both directions, at a speed that holds, make one possible."
        return Section("crosscheck", "Cross-check", {"check": None, "why": why})
    words = {
        "check": check, "agrees": check.agrees, "sentence": sentence, "kept": ", ".join(check.kept),
        "rows": [_row(row) for row in check.rows], "unexplained": percent(check.unexplained),
    }  # fmt: skip
    return Section("crosscheck", "Cross-check", words)


def _row(row: ComparedQuantity) -> dict[str, Any]:
    verdict = "informs only" if not row.counts else "agrees" if row.agrees else "disagrees"
    return {
        "name": row.name, "unit": row.unit, "fitted": _with_half(row.fitted, row.fitted_half),
        "regressed": _with_half(row.regressed, row.regressed_half), "difference": number(row.difference, 2),
        "reach": f"±{number(row.reach, 2)}", "verdict": verdict,
        "mood": {"agrees": "good", "disagrees": "bad"}.get(verdict, "neutral"),
    }  # fmt: skip


def _with_half(value: float, half: float) -> str:
    return f"{number(value, 4)}{NARROW}±{NARROW}{number(half, 2)}"
