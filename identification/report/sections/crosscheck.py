"""The second opinion: the coefficients that sparse regression finds in the measured force."""

from __future__ import annotations

import math
from typing import Any

from identification.report.section import Section
from identification.report.wording.numbers import NARROW, number
from identification.result import FitResult
from identification.sparse_regression import ComparedCoefficient


def crosscheck(identification: FitResult) -> Section:
    """The cross-check section; a sentence why there is none where there is none."""
    check = identification.crosscheck
    if check is None:
        return Section("crosscheck", "Cross-check", {"check": None, "why": _why_none(identification)})
    words = {
        "check": check, "agrees": bool(check.agrees), "sentence": f"{check.sentence[0].upper()}{check.sentence[1:]}.",
        "rows": [_row(row) for row in check.rows], "kept": ", ".join(check.kept),
    }  # fmt: skip
    return Section("crosscheck", "Cross-check", words)


def _row(row: ComparedCoefficient) -> dict[str, Any]:
    verdict = "informs only" if not row.counts else "agrees" if row.agrees else "disagrees"
    difference = 100 * float(row.difference)
    shown = f"{'+' if difference > 0 else ''}{number(difference, 2)}{NARROW}%" if math.isfinite(difference) else "–"
    return {
        "name": row.name, "unit": row.unit,
        "fitted": number(float(row.fitted), 4), "regressed": number(float(row.regressed), 4),
        "difference": shown, "gate": f"±{number(100 * row.gate, 2)}{NARROW}%",
        "verdict": verdict, "mood": {"agrees": "good", "disagrees": "bad"}.get(verdict, "neutral"),
    }  # fmt: skip


def _why_none(identification: FitResult) -> str:
    if "lugre" not in identification.model.effects:
        return "There is no cross-check: the model has no LuGre friction, whose bristle force the regression needs."
    return (
        "There is no cross-check: it was switched off, or the stem slides too little in these recordings to tell the "
        "bristle force that the regression needs. Long strokes in both directions make it possible."
    )
