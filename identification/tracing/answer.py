"""The answer of a trace in words, and as `trace.json` of the contract."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.sparse_regression import Crosscheck
from identification.tracing.judge import Candidate
from identification.tracing.settings import COMPLETE_LOSS

if TYPE_CHECKING:
    from identification.tracing.result import Trace


def sentences(trace: Trace) -> list[str]:
    """The answer in words, one sentence each."""
    found, effects, out = trace.selection, trace.catalogue, list[str]()
    if found.verdict == "none":
        out.append("Nothing is missing: what the model leaves is noise of the size the recordings have.")
    elif found.only_held_out and not found.added:
        out.append("Something is missing, and the recordings that were fitted do not show what.")
    elif found.verdict == "unlisted":
        out.append("Something is missing, and it is none of the effects known here.")
        out += _nearest(trace)
    for effect in found.added:
        out.append(f"The model lacked {effect}: {effects[effect].sentence}. Check {effects[effect].check}.")
    if found.same_class:
        out.append(f"These recordings cannot tell it from {', '.join(found.same_class)}.")
    if trace.second_opinion is not None:
        out.append(f"{trace.second_opinion.sentence}.")
    if trace.residual is not None:
        out.append(f"Left: {trace.residual.description}; {trace.residual.where}.")
    if found.added and np.isfinite(trace.closed):
        out.append(f"{100 * trace.closed:.0f} % of the held-out gap between the error and the noise floor is closed.")
    return out


def _nearest(trace: Trace) -> list[str]:
    """What comes nearest where no name is given, in words; empty where nothing explains held-out data."""
    before = trace.selection.before
    accepted = (
        (c.effect, c.refit.held_out.loss)
        for c in trace.candidates if c.accepted and c.refit is not None and c.refit.held_out is not None
    )  # fmt: skip
    effect, loss = next(accepted, ("", np.inf))
    if before.excess <= 0 or loss >= before.loss:
        return []
    share = 1 - max(loss - COMPLETE_LOSS, 0.0) / before.excess
    return [
        f"{effect} comes nearest ({trace.catalogue[effect].sentence}): it explains {100 * share:.0f} % of what the "
        "held-out recordings hold beside the model, and too much is left with it for a name."
    ]


def as_json(trace: Trace) -> dict[str, Any]:
    """The content of `trace.json`; numbers may still be other than finite."""
    found = trace.selection
    base = {
        name: {"value": value.value, "std": value.std, "unit": value.unit, "status": value.status}
        for name, value in trace.base.model.parameters.items()
    }
    return {
        "format": "valve-trace", "version": 1,
        "base": {"effects": list(found.base.effects), "parameters": base},
        "residual": {
            "white": found.before.white, "p_value": found.before.p_value, "noise_floor_m": trace.error["noise_floor_m"],
        },
        "candidates": [_candidate(c, trace.holdout_rmse, trace.unit) for c in found.candidates],
        "verdict": found.verdict, "effects_added": list(found.added), "same_class": list(found.same_class),
        "unlisted": None if trace.residual is None else trace.residual.as_json(),
        "error": dict(trace.error),
        "residual_after": {"white": found.after.white, "p_value": found.after.p_value},
        "crosscheck": _crosscheck(trace.final.crosscheck),
        "second_opinion": None if trace.second_opinion is None else asdict(trace.second_opinion),
    }  # fmt: skip


def finite(value: Any) -> Any:
    """The same with None for what is not finite: JSON has no word for it."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [finite(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return bool(value) if isinstance(value, np.bool_) else value


def _candidate(c: Candidate, rmse: Mapping[str, float], unit: str) -> dict[str, Any]:
    return {
        "effect": c.effect, "gain": c.gain, "p_value": None if c.held_out is None else c.held_out.p_value,
        f"holdout_rmse_{unit}": rmse.get(c.effect), "accepted": c.accepted, "why": c.why, "parameters": dict(c.values),
    }  # fmt: skip


def _crosscheck(check: Crosscheck | None) -> dict[str, Any] | None:
    if check is None:
        return None
    rows = [
        {"name": r.name, "unit": r.unit, "fit": r.fitted, "check": r.regressed, "gate": r.gate, "counts": r.counts}
        for r in check.rows
    ]
    return {"agrees": check.agrees, "rows": rows, "sentence": check.sentence}
