"""The parameter table: values with their uncertainty, bars, correlated pairs, the condition number."""

from __future__ import annotations

import math
from typing import Any

from identification.report.section import Section
from identification.report.wording.numbers import interval, number, percent, with_std
from identification.result import FitResult
from identification.uncertainty.repeats import Repeats
from simulator import Value

LEAST, MOST = 1e-6, 1e1
"""Relative standard deviations at the two ends of a bar."""
MARKS = ((1e-5, "0.001 %"), (1e-3, "0.1 %"), (0.3, "30 %"))
WEAK = 0.3
WORDS = {
    "identified": "identified", "weak": "weak", "unresolved": "not told by these recordings",
    "at_bound": "at its bound", "given": "given",
}  # fmt: skip
ILL_CONDITIONED = 1e3


def parameters(identification: FitResult) -> Section:
    """The parameter section."""
    model, known, repeats = identification.model, identification.uncertainty, identification.repeats
    declared = identification.fit.kernel.catalogue.parameters(model.effects)
    words = {
        "rows": [_row(name, value, declared[name].meaning, repeats) for name, value in model.parameters.items()],
        "marks": [(_place(at), label) for at, label in MARKS],
        "threshold": _place(WEAK),
        "pairs": [(a, b, number(c, 4)) for a, b, c in known.pairs()],
        "condition": number(known.condition),
        "ill": known.condition > ILL_CONDITIONED,
        "inflation": number(known.inflation),
        "repeats": [] if repeats is None else repeats.sentences(),
    }
    return Section("parameters", "Parameters", words)


def _row(name: str, value: Value, meaning: str, repeats: Repeats | None) -> dict[str, Any]:
    shown, std = with_std(value.value, value.std)
    relative = abs(value.std / value.value) if value.std and value.value else None
    positive = value.lower is not None and value.lower >= 0
    return {
        "name": name, "meaning": meaning, "value": shown, "std": std, "unit": value.unit,
        "interval": None if value.std is None else interval(value.value, value.std, positive),
        "repeats": "" if repeats is None else repeats.spread_of(name),
        "status": value.status, "status_words": WORDS[value.status], "note": value.note or "",
        "bar": None if relative is None else _place(relative),
        "relative": "" if relative is None else percent(relative),
    }  # fmt: skip


def _place(relative: float) -> float:
    """Where a relative standard deviation is on a bar, in percent of its length."""
    inside = min(max(relative, LEAST), MOST)
    return round(100 * math.log10(inside / LEAST) / math.log10(MOST / LEAST), 1)
