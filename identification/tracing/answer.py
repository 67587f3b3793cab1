"""The answer of a trace in words, and the rows of `trace.json`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from identification.sparse_regression.crosscheck import Crosscheck
from identification.tracing import settings
from identification.tracing.crosscheck import SecondOpinion
from identification.tracing.judge import Candidate
from identification.tracing.residual import ResidualDescription
from identification.tracing.verdict import BASE_MODEL, Selection


def sentences(
    found: Selection, residual: ResidualDescription | None, opinion: SecondOpinion | None, closed: float
) -> list[str]:
    """The answer in words, one sentence each. closed : share of the gap to the noise floor that was closed."""
    effects, out = found.base.data.catalogue, list[str]()
    if found.complete_if_fitted_to_all:
        out.append("Nothing is missing: fitted to all recordings, the model leaves noise of the size that they have.")
        out.append("The noise of the motion moves its parameters by more than their errors say.")
    elif found.verdict == "none":
        out.append("Nothing is missing: what the model leaves is noise of the size the recordings have.")
    elif BASE_MODEL in found.not_tried:
        out.append("The time was over before the model without added effects was fitted: what it lacks is not known.")
    elif found.only_held_out and not found.added:
        out.append("Something is missing, and the recordings that were fitted do not show what.")
    elif found.verdict == "unlisted":
        tried = (
            "it is none of the effects known here" if not found.not_tried else "no effect that was tried explains it"
        )
        out.append(f"Something is missing, and {tried}.")
        out += _nearest(found)
    for effect in found.added:
        out.append(f"The model lacked {effect}: {effects[effect].sentence}. Check {effects[effect].check}.")
    if found.same_class:
        out.append(f"These recordings cannot tell it from {', '.join(found.same_class)}.")
    if opinion is not None:
        out.append(f"{opinion.sentence}.")
    if residual is not None:
        out.append(f"Left: {residual.description}; {residual.where}.")
    out += _reported(found, closed)
    if found.not_tried:
        out.append(f"The budget of time was over before all was tried; left out: {', '.join(found.not_tried)}.")
    return out


def _reported(found: Selection, closed: float) -> list[str]:
    """On which data the errors are reported, in words, and where an effect was added how much smaller they are."""
    if found.added and np.isfinite(closed):
        return [f"{100 * closed:.0f} % of the gap between the error and the noise floor is closed {_where(found)}."]
    return [f"The error called 'report' is that {_where(found)}."] if found.report_experiments else []


def _where(found: Selection) -> str:
    """On which data the errors before and after are compared."""
    if not found.report_experiments:
        return "on the held-out data"
    spans = sum(float(s.t[-1] - s.t[0]) for e in found.report_experiments for s in e.segments)
    return f"on {spans:.3g} s of data that neither fitted nor chose the model"


def _nearest(found: Selection) -> list[str]:
    """What comes nearest where no name is given, in words; empty where nothing explains held-out data."""
    before = found.before
    accepted = (
        (c.effect, c.refit.held_out.loss)
        for c in found.candidates if c.accepted and c.refit is not None and c.refit.held_out is not None
    )  # fmt: skip
    effect, loss = next(accepted, ("", np.inf))
    if before.excess <= 0 or loss >= before.loss:
        return []
    share = 1 - max(loss - settings.COMPLETE_LOSS, 0.0) / before.excess
    sentence = found.base.data.catalogue[effect].sentence
    return [
        f"{effect} comes nearest ({sentence}): it explains {100 * share:.0f} % of what the "
        "held-out recordings hold beside the model, and too much is left with it for a name."
    ]


def candidate_row(c: Candidate, rmse: Mapping[str, float], unit: str) -> dict[str, Any]:
    """A candidate as `trace.json` has it."""
    return {
        "effect": c.effect, "gain": c.gain, "p_value": None if c.held_out is None else c.held_out.p_value,
        f"holdout_rmse_{unit}": rmse.get(c.effect), "accepted": c.accepted, "why": c.why, "parameters": dict(c.values),
        "refit": None if c.refit is None else dict(c.refit.values),
    }  # fmt: skip


def crosscheck_rows(check: Crosscheck | None) -> dict[str, Any] | None:
    """The cross-check of the final model as `trace.json` has it; None where nothing could be compared."""
    if check is None or not check.decides:
        return None
    rows = [
        {
            "name": r.name, "unit": r.unit, "fit": r.fitted, "fit_half_90": r.fitted_half, "check": r.regressed,
            "check_half_90": r.regressed_half, "allowed": r.allowed, "counts": r.counts, "agrees": r.agrees,
        }
        for r in check.rows
    ]  # fmt: skip
    return {"agrees": check.agrees, "rows": rows, "sentence": check.sentence}
