"""What a trace says: verdict, candidates, error before and after; `trace.json` of the contract, and its words."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.data.experiment import Experiment, imposed
from identification.data.grid import with_smooth_force
from identification.result import Identification, error_of
from identification.sparse_regression import Crosscheck
from identification.tracing.algorithm import Candidate, Tracing, select
from identification.tracing.crosscheck import SecondOpinion, second_opinion
from identification.tracing.free_runs import holdout_rmse, identification_of, position_error
from identification.tracing.judge import COMPLETE
from identification.tracing.model import Model
from identification.tracing.residual import Remainder, remainder
from recordings import Recording, save_text
from simulator import CATALOGUE, ValveModel


@dataclass(frozen=True)
class Trace:
    """The answer to the question what a model lacks.

    tracing : the models and the candidates; base, final : before and after, with free runs and `model.json`;
    holdout_rmse : error [`unit`] of the refitted candidates on held-out data, by effect; left : what no candidate
    explains, or None; error : free-run errors before and after, on the fitted and the held-out recordings, with the
    noise floor. Where the force is predicted there is also its error, ``rmse_N``. opinion : what
    sparse regression chooses, where it can say anything.
    """

    tracing: Tracing
    base: Identification
    final: Identification
    holdout_rmse: Mapping[str, float]
    left: Remainder | None
    error: Mapping[str, Any]
    opinion: SecondOpinion | None

    @property
    def unit(self) -> str:
        """What is predicted: a position in m, or a force in N."""
        return "N" if self.tracing.base.data.imposed else "m"

    @property
    def verdict(self) -> str:
        """An effect id, ``none`` or ``unlisted``."""
        return self.tracing.verdict

    @property
    def effects_added(self) -> tuple[str, ...]:
        """Accepted effects in the order of acceptance."""
        return self.tracing.added

    @property
    def same_class(self) -> tuple[str, ...]:
        """Effects that these recordings cannot tell from the verdict."""
        return self.tracing.same_class

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """Every candidate tried, best first."""
        return self.tracing.candidates

    @property
    def model(self) -> ValveModel:
        """The model after tracing."""
        return self.final.model

    @property
    def closed(self) -> float:
        """Share of the held-out gap between the base's error and the noise floor that was closed."""
        errors = ((self.error[side]["holdout"] or {}).get(f"rmse_{self.unit}", np.nan) for side in ("before", "after"))
        before, after = errors
        gap = before - self.error[f"noise_floor_{self.unit}"]
        return float((before - after) / gap) if gap > 0 else 0.0

    def as_json(self) -> dict[str, Any]:
        """The content of `trace.json`."""
        t = self.tracing
        base = {
            name: {"value": value.value, "std": value.std, "unit": value.unit, "status": value.status}
            for name, value in self.base.model.parameters.items()
        }
        return {
            "format": "valve-trace", "version": 1,
            "base": {"effects": list(t.base.effects), "parameters": base},
            "residual": {
                "white": t.before.white, "p_value": t.before.p_value, "noise_floor_m": self.error["noise_floor_m"],
            },
            "candidates": [_candidate(c, self.holdout_rmse, self.unit) for c in t.candidates],
            "verdict": t.verdict, "effects_added": list(t.added), "same_class": list(t.same_class),
            "unlisted": None if self.left is None else self.left.as_json(),
            "error": dict(self.error),
            "residual_after": {"white": t.after.white, "p_value": t.after.p_value},
            "crosscheck": _checked(self.final.crosscheck),
            "second_opinion": None if self.opinion is None else asdict(self.opinion),
        }  # fmt: skip

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `trace.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_text(Path(path), json.dumps(_finite(self.as_json()), indent=1, allow_nan=False) + "\n")

    def sentences(self) -> list[str]:
        """The answer in words."""
        t, out = self.tracing, []
        if t.verdict == "none":
            out.append("Nothing is missing: what the model leaves is noise of the size the recordings have.")
        elif t.only_held and not t.added:
            out.append("Something is missing, and the recordings that were fitted do not show what.")
        elif t.verdict == "unlisted":
            out.append("Something is missing, and it is none of the effects known here.")
            out += self._nearest()
        for effect in t.added:
            out.append(f"The model lacked {effect}: {CATALOGUE[effect].sentence}. Check {CATALOGUE[effect].check}.")
        if t.same_class:
            out.append(f"These recordings cannot tell it from {', '.join(t.same_class)}.")
        if self.opinion is not None:
            out.append(f"{self.opinion.sentence}.")
        if self.left is not None:
            out.append(f"Left: {self.left.description}; {self.left.where}.")
        if t.added and np.isfinite(self.closed):
            out.append(
                f"{100 * self.closed:.0f} % of the held-out gap between the error and the noise floor is closed."
            )
        return out

    def _nearest(self) -> list[str]:
        """What comes nearest where no name is given, in words; empty where nothing explains held-out data."""
        t = self.tracing
        accepted = (
            (c.effect, c.refit.held.loss)
            for c in t.candidates if c.accepted and c.refit is not None and c.refit.held is not None
        )  # fmt: skip
        effect, loss = next(accepted, ("", np.inf))
        missing = t.before.loss - COMPLETE
        if missing <= 0 or loss >= t.before.loss:
            return []
        share = 1 - max(loss - COMPLETE, 0.0) / missing
        return [
            f"{effect} comes nearest ({CATALOGUE[effect].sentence}): it explains {100 * share:.0f} % of what the "
            "held-out recordings hold beside the model, and too much is left with it for a name."
        ]


def trace(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    given: Mapping[str, float] | None = None,
    hold: bool = False,
) -> Trace:
    """Find what a model of the base effects lacks in recordings: fit, test, add, refit, judge on held-out data.

    holdout : recordings that only judge; without any, the last quarter of each recording. given : parameters held, by
    full name, SI units; hold : the force is held between samples. Raises BadInput and NegativeAnswer as `identify`.
    """
    found = select(recordings, holdout=holdout, given=given, hold=hold)
    if found.base.data.imposed:
        fitted, held = ([imposed(e) for e in some] for some in (found.experiments, found.held))
    else:
        fitted = with_smooth_force(found.experiments, found.base.data.fitted)
        held = with_smooth_force(found.held, found.base.data.held)
    base = identification_of(found.base, recordings, fitted, held)
    final = base if found.final is found.base else identification_of(found.final, recordings, fitted, held)
    left = None if found.after.white and found.verdict != "unlisted" else remainder(found)
    rmse = {c.effect: holdout_rmse(c.refit, fitted, held) for c in found.candidates if c.refit is not None}
    opinion = None if found.verdict == "none" else second_opinion(found.base)
    return Trace(found, base, final, rmse, left, _errors(found, base, final), opinion)


def _errors(found: Tracing, base: Identification, final: Identification) -> dict[str, Any]:
    """The errors as `trace.json` has them."""
    errors: dict[str, Any] = {}
    for side, model, runs in (("before", found.base, base), ("after", found.final, final)):
        errors[side] = {
            where: _error(model, error_of(some), experiments)
            for where, some, experiments in (
                ("fit", runs.trajectories, found.experiments), ("holdout", runs.holdout, found.held)
            )
        }  # fmt: skip
    errors["noise_floor_m"] = float(np.sqrt(np.mean([e.noise_position**2 for e in found.experiments])))
    if found.base.data.imposed:
        errors["noise_floor_N"] = float(np.sqrt(np.mean([np.mean(s.force.std**2) for s in found.base.data.fitted])))
    return errors


def _error(model: Model, error: dict[str, float] | None, experiments: Sequence[Experiment]) -> dict[str, float] | None:
    """A free-run error; where it is the force's, the position's beside it, with the plain names of the contract."""
    if not model.data.imposed or error is None:
        return error
    position = position_error(model, experiments)
    return {"rmse_N": error["rmse_N"], "nrmse_N": error.get("nrmse", 0.0)} | position


def _candidate(c: Candidate, rmse: Mapping[str, float], unit: str) -> dict[str, Any]:
    return {
        "effect": c.effect, "gain": c.gain, "p_value": None if c.held is None else c.held.p_value,
        f"holdout_rmse_{unit}": rmse.get(c.effect), "accepted": c.accepted, "why": c.why, "parameters": dict(c.values),
    }  # fmt: skip


def _checked(check: Crosscheck | None) -> dict[str, Any] | None:
    if check is None:
        return None
    rows = [
        {"name": r.name, "unit": r.unit, "fit": r.fitted, "check": r.regressed, "gate": r.gate, "counts": r.counts}
        for r in check.rows
    ]
    return {"agrees": check.agrees, "rows": rows, "sentence": check.sentence}


def _finite(value: Any) -> Any:
    """The same with None for what is not finite: JSON has no word for it."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_finite(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return bool(value) if isinstance(value, np.bool_) else value
