"""The key figures as cards: about the valve, and about how far to trust them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from identification.report.wording.fit_quality import FitQuality
from identification.report.wording.key_figures import KeyFigures, key_figures
from identification.report.wording.numbers import force_words, mm_words, number, percent, plain
from identification.result import FitResult


@dataclass(frozen=True)
class Card:
    """A key figure: label, value, a line below it, whether it is good, a warning, bad or neutral, and the parameters
    it rests on.
    """

    label: str
    value: str
    below: str = ""
    mood: str = "neutral"
    rests_on: tuple[str, ...] = ()


def cards(identification: FitResult, quality: FitQuality | None) -> list[Card]:
    """All cards; a figure that rests on a weak parameter is a warning. judged : None where it is said elsewhere."""
    weak = {n for n, p in identification.model.parameters.items() if p.status in ("weak", "unresolved", "at_bound")}
    valve = [
        Card(c.label, c.value, f"{c.below}; weakly known", "warn") if weak & set(c.rests_on) else c
        for c in _valve(key_figures(identification))
    ]
    return [*valve, *([] if quality is None else [_residual(quality)]), _crosscheck(identification)]


def _valve(f: KeyFigures) -> Iterator[Card]:
    if f.friction is not None:
        share = "" if f.share is None else f"{percent(f.share)} of span: {force_words(f.span)}, {f.span_words}"
        yield Card("Friction at speed", force_words(f.friction), share, rests_on=("lugre.fc",))
    if f.friction and f.breakaway is not None:
        times = f"{number(f.breakaway / f.friction)} times the friction at speed"
        yield Card("Break-away", force_words(f.breakaway), times, rests_on=("lugre.fs",))
    if f.rate:
        span = f"{force_words(f.rate * f.travel)} over the {f.travel_words}"
        yield Card("Spring rate", f"{number(f.rate / 1e3)} N/mm", span, rests_on=("spring.K",))
    if f.preload is not None and (f.rate or f.preload):
        label = "Preload" if f.rate else "Constant force"
        yield Card(label, force_words(f.preload), _preload_words(f, f.preload), rests_on=("spring.F0",))
    if f.dead_band is not None:
        std = f" ± {number(1e3 * f.dead_band_std, 2)} mm" if f.dead_band_std else ""
        lost = f"{f.of_travel(f.dead_band)}; 2 fc / K{std}"
        yield Card("Dead band", mm_words(f.dead_band), lost, rests_on=("lugre.fc", "spring.K"))
    if f.jump is not None:
        lost = f"{f.of_travel(f.jump)}; (fs − fc) / K"
        yield Card("Stick-slip jump, about", mm_words(f.jump), lost, rests_on=("lugre.fc", "lugre.fs", "spring.K"))


def _preload_words(f: KeyFigures, preload: float) -> str:
    if not f.rate:
        return "weight, mean flow force or an offset of the sensor"
    if f.bench_set is not None:
        return f"bench set {f.bench_set_words}"
    if f.area:
        return f"{number(preload / f.area / 1e3)} kPa at x = 0; the stroke is not known"
    return "force at x = 0; no diaphragm area is known, so no bench set"


def _residual(quality: FitQuality) -> Card:
    below = "no recording was held out"
    if quality.held_out is not None:
        below = f"held-out recordings: {number(quality.held_out)}"
    if quality.window is not None:
        below = f"over {plain(quality.window)} s windows; free run {number(quality.free)}"
    return Card("Residual over noise", number(quality.ratio), below, quality.mood)


def _crosscheck(identification: FitResult) -> Card:
    check = identification.crosscheck
    if check is None or not check.decides:
        return Card("Cross-check", "none", "the section below says why")
    decided = [row for row in check.rows if row.counts]
    within = f"{sum(row.agrees for row in decided)} of {len(decided)} quantities found again in steady sliding"
    return Card("Cross-check", *(("agrees", within, "good") if check.agrees else ("disagrees", within, "bad")))
