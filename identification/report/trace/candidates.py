"""Every effect that was tried and what became of it."""

from __future__ import annotations

from typing import Any

from identification.report.section import Section
from identification.report.trace.answer import error_at, error_scale
from identification.report.wording.effects import effect_name, listed
from identification.report.wording.numbers import number
from identification.tracing.judge import Candidate
from identification.tracing.result import TraceResult


def candidates(trace: TraceResult) -> Section:
    """The section of what was tried, and the errors before and after."""
    factor, unit = error_scale(trace)
    refitted = [c for c in trace.candidates if c.refit is not None]
    models = (("before", "before"), ("after", "after")) if trace.effects_added else (("before", "model"),)
    words = {
        "unit": unit,
        "errors": [
            {"model": name, "fit": _sized(error_at(trace, side, "fit"), factor),
             "holdout": _sized(error_at(trace, side, "holdout"), factor),
             "report": _sized(error_at(trace, side, "report"), factor)}
            for side, name in models
        ],
        "floor": _sized(trace.error[f"noise_floor_{trace.unit}"], factor),
        "refitted": [_row(c, trace, factor) for c in refitted],
        "others": _others([c for c in trace.candidates if c.refit is None]),
    }  # fmt: skip
    return Section("candidates", "What was tried", words)


def _row(c: Candidate, trace: TraceResult, factor: float) -> dict[str, Any]:
    return {
        "name": effect_name(c.effect), "accepted": c.accepted, "why": _why(c), "gain": number(c.gain),
        "t": "–" if c.held_out is None else number(c.held_out.t),
        "error": _sized(trace.holdout_rmse.get(c.effect), factor),
    }  # fmt: skip


def _why(c: Candidate) -> str:
    """The outcome; a gain below zero gets its word."""
    alone = "; alone it made the fit worse, beside the other effects it is needed" if c.accepted and c.gain < 0 else ""
    return c.why.replace(c.effect, effect_name(c.effect)).replace("_", " ") + alone


def _others(rest: list[Candidate]) -> list[tuple[str, str]]:
    """Reason and effects, of those that were not refitted to all of the recordings."""
    reasons = list(dict.fromkeys(c.why for c in rest))
    return [(why, listed([effect_name(c.effect) for c in rest if c.why == why])) for why in reasons]


def _sized(error: float | None, factor: float) -> str:
    return "–" if error is None else number(factor * error)
