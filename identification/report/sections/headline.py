"""The first thing on the page: what was found, in plain sentences, with the key figures below."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from identification.estimators.fitted import Outcome
from identification.report.runs import error_unit, output_name, rms, runs
from identification.report.section import Section
from identification.report.sections.cards import cards
from identification.report.wording.fit_quality import (
    AT_FLOOR,
    FAR_BELOW,
    NEAR_FLOOR,
    FitQuality,
    fit_quality,
    page_mood,
)
from identification.report.wording.key_figures import KeyFigures, key_figures
from identification.report.wording.numbers import force_words, mm_words, number, percent, plain
from identification.result import FitResult

WIDEST = 5
"""Cards in a row at most."""


def headline(identification: FitResult, *, traced: bool = False) -> Section:
    """The headline section; on the page of a trace, which judges the model itself, only the valve and its figures."""
    weak = [n for n, p in identification.model.parameters.items() if p.status in ("weak", "unresolved", "at_bound")]
    valve, quality = _valve(key_figures(identification), weak), fit_quality(identification)
    trust = [] if traced else [_trust(identification, quality), _second_opinion(identification)]
    if identification.fit.outcome is Outcome.NOT_EXPLAINED and not traced:
        sentences = [*trust, f"What the values would mean if it did: {valve[0].lower()}{valve[1:]}"]
    else:
        sentences = [valve, *trust]
    shown = cards(identification, None if traced else quality)
    words = {
        "mood": "" if traced else page_mood(identification),
        "sentences": [s for s in sentences if s],
        "cards": shown,
        "across": math.ceil(len(shown) / math.ceil(len(shown) / WIDEST)),
        "weak": weak,
        "advice": identification.advice,
    }
    return Section("headline", "The valve, by the model that came out" if traced else "What was found", words)


def _valve(f: KeyFigures, weak: Sequence[str]) -> str:
    """The valve in one sentence; what rests on weak parameters is `about`."""
    about = "about " if "lugre.fc" in weak else ""
    friction, spring, lost = "", "has no spring", ""
    if f.friction is not None:
        share = "" if f.share is None else f" ({percent(f.share)} of {'span' if f.rate else f.span_words})"
        friction = f"has {about}{force_words(f.friction)} of friction{share}"
    if f.rate:
        bench = "" if f.bench_set is None else f" (bench set {f.bench_set_words})"
        preload = "" if f.preload is None else f" with {force_words(f.preload)} of preload{bench}"
        spring = f"{'works against' if friction else 'has'} a spring of {number(f.rate / 1e3)} N/mm{preload}"
    if f.dead_band is not None:
        lost = f", so that a reversal loses {about}{mm_words(f.dead_band)}, {f.of_travel(f.dead_band)}"
    both = " and ".join(part for part in (friction, spring) if part)
    return f"This {'valve' if f.rate else 'plant'} {both}{lost}."


def _trust(identification: FitResult, quality: FitQuality) -> str:
    """How the fit ended and how well it follows the data."""
    outcome, every = identification.fit.outcome.value, runs(identification)
    factor, unit = error_unit(every)
    miss = rms(np.concatenate([r.error for r in every if r.role == "fitted"]))
    free = f"the simulated {output_name(every[0])} misses the measured one by {number(factor * miss)} {unit} rms"
    start = f"{outcome[0].upper()}{outcome[1:]}; "
    if quality.window is not None:
        windowed = f"over windows of {plain(quality.window)} s its residual is {_floor(quality.ratio)}"
        return f"{start}{windowed}; run freely, {free}, as a plant without spring adds up the smallest error."
    held_out = ""
    if quality.held_out is not None:
        held_out = f"; on recordings held out of the fit it is {_times(quality.held_out)}"
    return f"{start}{free}, which is {_floor(quality.free)}{held_out}."


def _floor(ratio: float) -> str:
    if not np.isfinite(ratio):
        return "not comparable with the noise, whose level is unknown"
    if ratio < FAR_BELOW:
        return f"less than the noise estimated from the recordings ({_times(ratio)}), an estimate that is too high"
    if ratio <= AT_FLOOR:
        return f"all noise ({_times(ratio)})"
    if ratio <= NEAR_FLOOR:
        return f"nearly all noise ({_times(ratio)})"
    return f"{_times(ratio)}: these recordings show something that the model lacks"


def _times(ratio: float) -> str:
    return f"{number(ratio)} times the noise floor"


def _second_opinion(identification: FitResult) -> str:
    check = identification.crosscheck
    return "" if check is None or not check.decides else f"Cross-check: {check.sentence}."
