"""The first thing on the page of a trace: the answer, how sure it is, and the error before and after."""

from __future__ import annotations

from identification.report.runs import error_unit, runs
from identification.report.section import Section
from identification.report.sections.cards import Card
from identification.report.trace.before_after import before_after, close_view, stacked
from identification.report.trace.wording import answer
from identification.report.wording.numbers import number, percent
from identification.tracing.result import TraceResult

MOSTLY = 0.5
"""Share of the error beyond noise from which its fall is good news."""


def answer_section(trace: TraceResult) -> Section:
    """The section of the answer."""
    shown, found = before_after(trace), answer(trace)
    shown_cards = _cards(trace)
    words = {
        "answer": found, "cards": shown_cards, "across": len(shown_cards), "shown": shown,
        "added": bool(trace.effects_added),
    }  # fmt: skip
    plots = {"whole": stacked(shown)} | ({} if trace.verdict == "none" else {"close": close_view(shown)})
    return Section("answer", "Answer", words, plots)


def error_scale(trace: TraceResult) -> tuple[float, str]:
    """Factor and unit of every error on the page."""
    return error_unit(runs(trace.final))


def error_at(trace: TraceResult, side: str, where: str) -> float | None:
    """A free-run error [`unit`]; None where it is not known."""
    return (trace.error[side][where] or {}).get(f"rmse_{trace.unit}")


def _cards(trace: TraceResult) -> list[Card]:
    factor, unit = error_scale(trace)
    where = trace.reported if trace.base.holdout else "fit"
    on = {"report": "data set aside", "holdout": "held-out recordings", "fit": "fitted recordings"}[where]

    def sized(value: float | None) -> str:
        return "unknown" if value is None else f"{number(factor * value)} {unit}"

    before, after = error_at(trace, "before", where), error_at(trace, "after", where)
    floor = trace.error[f"noise_floor_{trace.unit}"]
    least = "estimated; the model is below it" if after is not None and after < floor else "the least a model can reach"
    noise = Card("Noise of the sensor", sized(floor), least)
    if not trace.effects_added:
        return [Card("Error of the free run", sized(before), f"rms, {on}"), noise]
    return [
        Card("Error before", sized(before), f"free run, rms, {on}"),
        Card("Error after", sized(after), _gone(trace, before, after), "good" if trace.closed > MOSTLY else "neutral"),
        noise,
    ]


def _gone(trace: TraceResult, before: float | None, after: float | None) -> str:
    if before is None or after is None:
        return "a free run diverged"
    if before <= trace.error[f"noise_floor_{trace.unit}"]:
        return "both are below the estimated noise"
    share = "all" if trace.closed >= 1.0 else percent(max(trace.closed, 0.0))
    return f"{share} of the error beyond the noise is gone"
