"""The answer of a trace in words: what is missing, how sure that is and why, what to check and to measure next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from identification.report.trace.dependence import residual_force, seen_models
from identification.report.wording.effects import SHOWN, effect_name, listed, sizes
from identification.report.wording.numbers import number, percent, plain
from identification.tracing import settings
from identification.tracing.judge import Candidate
from identification.tracing.models.comparison import Comparison
from identification.tracing.residual import ResidualDescription
from identification.tracing.result import TraceResult

SURE, LIKELY = 1e-3, 1e-2
"""Probabilities of the held-out test below which it makes an answer sure, and likely."""
NEARLY_ALL, MOST = 0.9, 0.75
"""Shares of the misfit beyond noise that a named effect explains in a sure answer, and in a likely one."""


@dataclass(frozen=True)
class Answer:
    """lead : the verdict in a sentence; more : what belongs to it; level : how sure, in a few words; because : the
    reason in a sentence; evidence : title and sentence of what that rests on; on_site : what to check; next : what to
    record.
    """

    lead: str
    more: tuple[str, ...]
    level: str
    because: str
    evidence: tuple[tuple[str, str], ...]
    on_site: tuple[str, ...]
    next: str


def answer(trace: TraceResult) -> Answer:
    """The answer of a trace."""
    return Answer(
        lead=_lead(trace), more=tuple(_more(trace)), level=_level(trace), because=_because(trace),
        evidence=tuple(_evidence(trace)), on_site=tuple(_on_site(trace)), next=_next(trace),
    )  # fmt: skip


def explained(trace: TraceResult) -> float:
    """Share of the misfit that the held-out recordings hold beyond a complete model's, explained by what was added."""
    before, after = trace.selection.before.excess, trace.selection.after.excess
    return float(np.clip(1 - max(after, 0.0) / before, 0.0, 1.0)) if before > 0 else 1.0


def chosen(trace: TraceResult) -> Candidate | None:
    """The candidate that was taken and explains held-out recordings alone, beside the base model."""
    taken = (c for c in trace.candidates if c.accepted and c.effect in trace.effects_added)
    return next((c for c in taken if c.gain > 0 and c.held_out is not None and c.held_out.gain > 0), None)


def _lead(trace: TraceResult) -> str:
    names = [effect_name(effect) for effect in trace.effects_added]
    if trace.selection.complete_if_fitted_to_all:
        return "Nothing is missing: fitted to all recordings, the model's errors are no larger than noise."
    if trace.verdict == "none":
        return f"Nothing is missing: on {_judges(trace)}, the model's errors are no larger than noise."
    if not names and trace.selection.only_held_out:
        return "Something is missing, but only the held-out recordings show it. The fitted ones do not tell what it is."
    if not names:
        return "Something is missing, and none of the known effects explains it."
    if len(names) == 1:
        return f"The model lacked one effect, {names[0]}: {trace.catalogue[trace.verdict].sentence}."
    return f"The model lacked {len(names)} effects: {listed(names)}."


def _more(trace: TraceResult) -> Iterator[str]:
    if trace.verdict == "none":
        size = f"{number(trace.selection.before.loss)} times those of a complete model"
        yield (
            f"The errors are those of the prediction from sample to sample: {size}. None of the "
            f"{len(trace.candidates)} effects that were tried makes them smaller by more than chance does."
        )
    if len(trace.effects_added) > 1:
        for effect in trace.effects_added:
            yield f"{effect_name(effect).capitalize()}: {trace.catalogue[effect].sentence}."
    for effect in trace.effects_added:
        yield f"Fitted {effect_name(effect)}: {'; '.join(sizes(trace.catalogue[effect], trace.model))}."
    if trace.verdict == "unlisted":
        yield from _nearest(trace)
    if trace.residual is not None:
        yield _remains(trace)


def _judges(trace: TraceResult) -> str:
    """The recordings that judge; the end of each recording where none was held out."""
    fitted, held = trace.base.trajectories, trace.base.holdout
    names = list(dict.fromkeys(t.name for t in held))
    if len(fitted) == len(held) and all(np.nanmin(b.t) >= np.nanmax(a.t) for a, b in zip(fitted, held, strict=True)):
        return f"the last part of {listed(names)}, which was not fitted"
    return f"{listed(names)}, which {'was' if len(names) == 1 else 'were'} not fitted"


def _nearest(trace: TraceResult) -> Iterator[str]:
    """The effect that explains most of what is missing, where no name is given."""
    tried = [c for c in trace.candidates if c.accepted and c.refit is not None and c.refit.held_out is not None]
    missing = trace.selection.before.excess
    if not tried or missing <= 0:
        return
    refit = tried[0].refit
    assert refit is not None
    assert refit.held_out is not None
    share = 1 - max(refit.held_out.loss - settings.COMPLETE_LOSS, 0.0) / missing
    if share > 0:
        yield (
            f"The nearest is {effect_name(tried[0].effect)} ({trace.catalogue[tried[0].effect].sentence}). It explains "
            f"{percent(share)} of what is missing, which is too little for a name."
        )


def _remains(trace: TraceResult) -> str:
    """How large a force remains, and where it is largest."""
    assert trace.residual is not None
    rms, over_noise = residual_force(seen_models(trace)[-1])
    kept = "What remains" if trace.effects_added else "What is missing"
    noise = f"{number(over_noise)} times the noise of the recorded force"
    return f"{kept} acts like a force of {number(rms)} N rms ({noise}). It is largest {_place(trace.residual)}."


def _place(residual: ResidualDescription) -> str:
    """The place of what remains, in the units of the page, to four digits."""
    factor, unit = SHOWN.get(residual.unit, (1.0, residual.unit))
    low, high = (plain(float(f"{factor * end:.4g}")) for end in (residual.low, residual.high))
    return f"at a {residual.quantity} of {low}{f' to {high}' if high != low else ''} {unit}"


def _level(trace: TraceResult) -> str:
    """How sure, in a few words."""
    if trace.verdict == "none":
        return "Sure, as far as these recordings can show"
    if not trace.effects_added:
        sure = "Sure" if trace.selection.before.p_value < SURE else "Likely"
        return f"{sure} that something is missing; not known what"
    best, share = chosen(trace), explained(trace)
    p = best.held_out.p_value if best is not None and best.held_out is not None else 1.0
    sure = "Sure" if p < SURE and share >= NEARLY_ALL else "Likely" if p < LIKELY and share >= MOST else "Tentative"
    if trace.same_class:
        return f"{sure} that it is one of {len(trace.same_class) + 1} effects that look alike here"
    return sure


def _because(trace: TraceResult) -> str:
    """Why it is as sure as that."""
    best, found = chosen(trace), trace.selection.before
    if best is None or best.held_out is None:
        return f"Noise alone makes errors as large as these with probability {_probability(found.p_value)}."
    return (
        f"On recordings that were not fitted it explains {percent(explained(trace))} of the misfit beyond noise; as "
        f"clear a gain comes by chance with probability {_probability(best.held_out.p_value)}."
    )


def _evidence(trace: TraceResult) -> Iterator[tuple[str, str]]:
    best = chosen(trace)
    if best is not None and best.held_out is not None:
        yield "Held-out test", _tested(trace, best, best.held_out)
        yield "Chance", _chance(trace, best)
    else:
        yield "Held-out test", _whiteness(trace)
    if trace.effects_added:
        yield "Explained", _explained(trace)
        yield "Alternatives", _alternatives(trace)
    if trace.verdict == "none":
        yield "Limits", "An effect that these motions do not excite, or that is smaller than the noise, cannot be seen."
    if trace.second_opinion is not None:
        yield "Second opinion", _opinion(trace)


def _tested(trace: TraceResult, best: Candidate, held: Comparison) -> str:
    return (
        f"With {effect_name(best.effect)} the model predicts {_judges(trace)}, better than without it, compared second "
        f"by second (t = {number(held.t)}; by chance with probability {_probability(held.p_value)})."
    )


def _whiteness(trace: TraceResult) -> str:
    found = trace.selection.before
    chance = f"by noise alone with probability {_probability(found.p_value)}"
    compared = f"{number(found.loss)} times those of a complete model; {chance}"
    if found.white:
        return f"The errors of the prediction, sample by sample, are no larger than noise ({compared})."
    return f"The errors of the prediction, sample by sample, are larger than noise ({compared})."


def _chance(trace: TraceResult, best: Candidate) -> str:
    if trace.unit == "N":
        return "Not simulated where the motion is imposed: there the fit hardly misses its best."
    if best.chance is not None:
        found = f"as much is hardly gained by chance (p = {best.chance:.2g})"
        return f"Simulated recordings without the effect were traced as well: {found}."
    return f"The misfit of the fitted recordings falls by {number(best.gain)}, far beyond what fits gain by chance."


def _explained(trace: TraceResult) -> str:
    share = f"{percent(explained(trace))} of the held-out misfit beyond noise is explained"
    if trace.selection.after.white:
        return f"{share}; what remains is noise."
    return f"{share}; what remains is {number(trace.selection.after.loss)} times the misfit of a complete model."


def _alternatives(trace: TraceResult) -> str:
    if not trace.same_class:
        return "No other effect that was tried explains these recordings as well."
    names = listed([effect_name(effect) for effect in trace.same_class])
    return f"These recordings cannot tell it from {names}. The simplest of them is named."


def _opinion(trace: TraceResult) -> str:
    assert trace.second_opinion is not None
    if trace.second_opinion.effect == "none":
        return "Sparse regression of the force, a quick look by other means, finds no effect."
    share = percent(trace.second_opinion.share)
    found = f"{effect_name(trace.second_opinion.effect)}, which explains {share} of the residual force"
    if trace.second_opinion.effect in trace.effects_added:
        return f"Sparse regression of the force, a quick look by other means, chooses the same: {found}."
    return (
        f"Sparse regression of the force chooses {found}. It is a quick look by other means that refits nothing, and "
        "does not change the answer."
    )


def _on_site(trace: TraceResult) -> Iterator[str]:
    for effect in (*trace.effects_added, *trace.same_class):
        yield f"{effect_name(effect).capitalize()}: {trace.catalogue[effect].check}."


def _next(trace: TraceResult) -> str:
    if trace.residual is None:
        return ""
    if trace.selection.only_held_out:
        return f"Record more like {listed([t.name for t in trace.base.holdout])}, and fit to those recordings as well."
    return f"Record {trace.residual.next}."


def _probability(p: float) -> str:
    return f"below {number(1e-6, 1)}" if p < 1e-6 else number(p, 2)
