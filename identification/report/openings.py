"""The openings of the pages of a fit, of a trace and of a comparison."""

from __future__ import annotations

from identification.comparison.result import ComparisonResult, Difference
from identification.estimators.fitted import Outcome
from identification.report.trace.wording import Answer
from identification.report.wording.fit_quality import fit_quality, page_mood
from identification.report.wording.numbers import number, percent
from identification.result import FitResult
from identification.tracing.result import TraceResult
from recordings import ReportOpening

TRACE = "find what is missing: bristle trace, with the same recordings"
"""What to do where a model lacks something."""
GROWN = 0.5
"""Growth of friction, as a share, from which a comparison advises work: half as much again."""
LOST = 0.2
"""Change of the spring rate, as a share, from which it does: no wear of a whole spring is as much."""


def fit_opening(found: FitResult) -> ReportOpening:
    """Of a fit. It judges the model: what is worn, only a comparison or a trace can tell."""
    quality, mood, check = fit_quality(found), page_mood(found), found.crosscheck
    judged = "recordings held out of the fit" if found.holdout else "no recording was held out"
    sure = f"errors are {number(quality.ratio)} times the noise; {judged}"
    if check is not None and check.decides:
        sure += f"; the cross-check {'agrees' if check.agrees else 'disagrees'}"
    if found.fit.outcome is Outcome.NOT_EXPLAINED:
        why = "friction and spring alone do not explain these recordings: do not build on the values below"
        return ReportOpening("watch", why, sure, TRACE)
    if not found.converged:
        why = f"{found.fit.outcome.value}: the values below are not final"
        again = "record more varied motion, or hold the parameters that are known, and fit again"
        lacks = found.fit.outcome is Outcome.NOT_CONVERGED  # mostly: what is left does not look like noise
        return ReportOpening("watch", why, sure, TRACE if lacks else again)
    if mood != "good":
        why = "the model follows the recordings, but not down to the noise" if quality.mood == "bad" else (
            "the model follows the recordings, and the cross-check does not confirm it"
        )  # fmt: skip
        return ReportOpening("watch", why, sure, TRACE)
    why = "friction and spring explain these recordings"
    action = "keep the model; compare a later test with this one (bristle compare), or watch with it (bristle monitor)"
    return ReportOpening("good", why, sure, action)


def trace_opening(found: TraceResult, told: Answer) -> ReportOpening:
    """Of a trace."""
    sure = told.level
    if found.verdict == "none":
        return ReportOpening("good", told.lead, sure, "nothing; test again at the next inspection and compare")
    action = told.on_site[0] if told.on_site else told.next
    return ReportOpening(
        "watch", told.lead, sure, f"check on site: {action}" if told.on_site else action or "record more"
    )


def comparison_opening(found: ComparisonResult) -> ReportOpening:
    """Of a comparison."""
    sure = f"intervals hold together with {percent(1.0 - found.level)}"
    if not found.alike:
        sure += "; the tests are not alike, which may be the reason"
    if not found.changed:
        why = "nothing changed beyond noise and repeatability"
        return ReportOpening("good", why, sure, "nothing; test again at the next inspection")
    worst = [one for one in found.quantities if one.changed and _heavy(one)]
    why = f"changed: {', '.join(found.changed)}"
    if worst and found.alike:
        name = worst[0].name
        action = (
            f"plan work: {name} changed by {percent(abs(_share(worst[0])))}; look at packing, stem and spring first"
        )
        return ReportOpening("repair", why, sure, action)
    action = "test again soon, in the same way, and see whether it goes on"
    return ReportOpening("watch", why, sure, action)


def _heavy(one: Difference) -> bool:
    """Whether a change is of a size that work should be planned for."""
    if one.name in {"friction", "lugre.fc", "lugre.fs"}:
        return _share(one) > GROWN
    return one.name in {"spring rate", "spring.K"} and abs(_share(one)) > LOST


def _share(one: Difference) -> float:
    return one.difference / abs(one.before.value) if one.before.value else 0.0
