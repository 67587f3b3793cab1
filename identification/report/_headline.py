"""The first thing on the page: what was found, in plain sentences and key figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification._fit import Outcome
from identification._result import Identification
from identification.report._key_figures import KeyFigures, key_figures
from identification.report._numbers import NARROW, number, percent
from identification.report._runs import Run, error_unit, output_name, rms, runs
from identification.report._section import Section

AT_FLOOR, NEAR_FLOOR = 1.1, 2.0
"""Residual over noise floor up to which the model explains everything, and up to which it explains nearly everything."""


@dataclass(frozen=True)
class Card:
    """A key figure: label, value, a line below it, and whether it is good, a warning, bad or neutral."""

    label: str
    value: str
    below: str = ""
    mood: str = "neutral"


def headline(identification: Identification) -> Section:
    """The headline section."""
    figures, every = key_figures(identification), runs(identification)
    weak = [n for n, p in identification.model.parameters.items() if p.status in ("weak", "at_bound")]
    sentences = [_valve(figures), _trust(identification, every), _second_opinion(identification)]
    if identification.fit.outcome is Outcome.NOT_EXPLAINED:
        sentences = [*sentences[1:], f"What the values would mean: {sentences[0]}"] if sentences[0] else sentences
    words = {
        "mood": _mood(identification, every),
        "sentences": [s for s in sentences if s],
        "cards": [*_valve_cards(figures, set(weak)), *_trust_cards(identification, every)],
        "weak": weak,
        "advice": identification.advice,
    }
    return Section("headline", "What was found", words)


def over_noise(some: list[Run]) -> float:
    """Root mean square error in multiples of the noise over several runs."""
    return rms(np.concatenate([r.error / (r.trajectory.noise or np.nan) for r in some]))


def _fitted(every: tuple[Run, ...]) -> list[Run]:
    return [r for r in every if r.role == "fitted"]


def _held_out(every: tuple[Run, ...]) -> list[Run]:
    return [r for r in every if r.role == "held out"]


def _mood(identification: Identification, every: tuple[Run, ...]) -> str:
    check, outcome = identification.crosscheck, identification.fit.outcome
    if outcome is Outcome.NOT_EXPLAINED:
        return "bad"
    doubt = outcome is not Outcome.CONVERGED or (check is not None and not check.agrees)
    return "good" if not doubt and over_noise(_fitted(every)) <= NEAR_FLOOR else "warn"


def _valve(f: KeyFigures) -> str:
    """The valve in one sentence."""
    friction, spring, lost = "", "has no spring", ""
    if f.friction is not None:
        share = "" if f.share is None else f" ({percent(f.share)} of {'span' if f.rate else f.span_words})"
        friction = f"has {_force(f.friction)} of friction{share}"
    if f.rate:
        bench = "" if f.bench_set is None else f" (bench set {_bench_set(f.bench_set)})"
        preload = "" if f.preload is None else f" with {_force(f.preload)} of preload{bench}"
        spring = f"{'works against' if friction else 'has'} a spring of {number(f.rate / 1e3)} N/mm{preload}"
    if f.dead_band is not None:
        lost = (
            f", so that a reversal loses {_mm(f.dead_band)}, {percent(f.dead_band / f.travel)} of the {f.travel_words}"
        )
    return f"This {'valve' if f.rate else 'plant'} {' and '.join(p for p in (friction, spring) if p)}{lost}."


def _trust(identification: Identification, every: tuple[Run, ...]) -> str:
    """How the fit ended and how well it follows the data."""
    outcome, (factor, unit) = identification.fit.outcome.value, error_unit(every)
    size = f"{number(factor * rms(np.concatenate([r.error for r in _fitted(every)])))} {unit}"
    ratio, held = over_noise(_fitted(every)), _held_out(every)
    text = f"{outcome[0].upper()}{outcome[1:]}; the simulated {output_name(every[0])} misses the measured one by {size} rms, {_floor(ratio)}"
    return f"{text}; on recordings held out of the fit it is {_times(over_noise(held))}." if held else f"{text}."


def _floor(ratio: float) -> str:
    if not np.isfinite(ratio):
        return "against an unknown noise floor"
    if ratio <= AT_FLOOR:
        return f"which is all noise ({_times(ratio)})"
    if ratio <= NEAR_FLOOR:
        return f"which is nearly all noise ({_times(ratio)})"
    return f"{_times(ratio)}: these recordings show something that the model lacks"


def _times(ratio: float) -> str:
    return f"{number(ratio)} times the noise floor"


def _second_opinion(identification: Identification) -> str:
    check = identification.crosscheck
    return "" if check is None else f"Cross-check: {check.sentence}."


def _valve_cards(f: KeyFigures, weak: set[str]) -> list[Card]:
    """Cards about the valve; a figure that rests on a weak parameter is a warning."""
    cards = []
    if f.friction is not None:
        share = "" if f.share is None else f"{percent(f.share)} of span: {_force(f.span)}, {f.span_words}"
        cards.append((("lugre.fc",), "Friction at speed", _force(f.friction), share))
    if f.friction and f.breakaway is not None:
        cards.append(
            (
                ("lugre.fs",),
                "Break-away",
                _force(f.breakaway),
                f"{number(f.breakaway / f.friction)} times the friction at speed",
            )
        )
    if f.rate:
        cards.append(
            (
                ("spring.K",),
                "Spring rate",
                f"{number(f.rate / 1e3)} N/mm",
                f"{_force(f.rate * f.travel)} over the {f.travel_words}",
            )
        )
    if f.preload is not None:
        cards.append((("spring.F0",), "Preload" if f.rate else "Constant force", _force(f.preload), _preload_words(f)))
    if f.dead_band is not None:
        std = f" ± {number(1e3 * f.dead_band_std, 2)}" if f.dead_band_std else ""
        lost = f"{percent(f.dead_band / f.travel)} of the {f.travel_words}; 2 fc / K{std and f', one std {std[3:]} mm'}"
        cards.append((("lugre.fc", "spring.K"), "Dead band", _mm(f.dead_band), lost))
    if f.jump is not None:
        jump = f"{percent(f.jump / f.travel)} of the {f.travel_words}; (fs − fc) / K"
        cards.append((("lugre.fc", "lugre.fs", "spring.K"), "Stick-slip jump, at least", _mm(f.jump), jump))
    return [
        Card(label, value, below, "warn" if weak & set(names) else "neutral") for names, label, value, below in cards
    ]


def _preload_words(f: KeyFigures) -> str:
    if not f.rate:
        return "weight, mean flow force or an offset of the sensor"
    if f.bench_set is not None:
        return f"bench set {_bench_set(f.bench_set)}"
    if f.area and f.preload is not None:
        return f"{number(f.preload / f.area / 1e3)} kPa at x = 0; the stroke is not known"
    return "force at x = 0; no diaphragm area is known, so no bench set"


def _trust_cards(identification: Identification, every: tuple[Run, ...]) -> list[Card]:
    ratio, held, check = over_noise(_fitted(every)), _held_out(every), identification.crosscheck
    mood = "good" if ratio <= AT_FLOOR else "warn" if ratio <= NEAR_FLOOR or not np.isfinite(ratio) else "bad"
    below = f"held-out recordings: {number(over_noise(held))}" if held else "no recording was held out"
    residual = Card("Residual over noise", number(ratio), below, mood)
    if check is None:
        return [residual, Card("Cross-check", "none", "the section below says why")]
    within = f"{sum(bool(row.agrees) for row in check.rows)} of {len(check.rows)} coefficients within their gates"
    return [
        residual,
        Card("Cross-check", *(("agrees", within, "good") if check.agrees else ("disagrees", within, "bad"))),
    ]


def _force(value: float) -> str:
    return f"{number(value)}{NARROW}N" if abs(value) < 1e4 else f"{number(value / 1e3)}{NARROW}kN"


def _mm(metres: float) -> str:
    return f"{number(1e3 * metres)}{NARROW}mm"


def _bench_set(pressures: tuple[float, float]) -> str:
    return f"{number(pressures[0] / 1e3)} to {number(pressures[1] / 1e3)} kPa"
