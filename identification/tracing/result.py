"""The answer of a trace, and the one call that gives it."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.result import Identification
from identification.summary import trace_html, trace_text
from identification.tracing import answer
from identification.tracing.algorithm import select
from identification.tracing.crosscheck import SecondOpinion, second_opinion
from identification.tracing.judge import Candidate
from identification.tracing.models.free_runs import (
    free_run_errors,
    free_run_experiments,
    holdout_rmse,
    identification_of,
)
from identification.tracing.residual import ResidualDescription, describe_residual
from identification.tracing.verdict import Selection
from recordings import Progress, Recording, save_text, silent, tracked
from simulator import CATALOGUE, Catalogue, ValveModel


@dataclass(frozen=True, repr=False)
class Trace:
    """The answer to the question what a model lacks.

    selection : the models under trial and their candidates, as forward selection left them
    base, final : the models before and after, each with free runs, uncertainties and its `model.json`
    holdout_rmse : free-run error of the refitted candidates on the held-out recordings, by effect [`unit`]
    residual : what no candidate explains, in words; None where that is only noise
    error : free-run errors ``before`` and ``after``, on the recordings ``fit`` and ``holdout``: ``rmse_m`` [m] and
        ``nrmse`` [1], or ``rmse_N`` [N] and ``nrmse_N`` [1] where the force is predicted; with ``noise_floor_m`` [m]
        and there ``noise_floor_N`` [N]
    second_opinion : what sparse regression chooses, or None where it can say nothing
    """

    selection: Selection
    base: Identification
    final: Identification
    holdout_rmse: Mapping[str, float]
    residual: ResidualDescription | None
    error: Mapping[str, Any]
    second_opinion: SecondOpinion | None

    def __repr__(self) -> str:
        return trace_text(self)

    def _repr_html_(self) -> str:
        return trace_html(self)

    @property
    def unit(self) -> str:
        """The unit of what is predicted: m for a position, N for a force."""
        return "N" if self.selection.base.data.imposed else "m"

    @property
    def catalogue(self) -> Catalogue:
        """The effects that were tried."""
        return self.selection.base.data.catalogue

    @property
    def verdict(self) -> str:
        """An effect id, ``none`` or ``unlisted``."""
        return self.selection.verdict

    @property
    def effects_added(self) -> tuple[str, ...]:
        """Ids of the accepted effects in the order of acceptance."""
        return self.selection.added

    @property
    def same_class(self) -> tuple[str, ...]:
        """Ids of the effects that these recordings cannot tell from the verdict."""
        return self.selection.same_class

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """Every candidate of the first round, best first."""
        return self.selection.candidates

    @property
    def model(self) -> ValveModel:
        """The model after tracing."""
        return self.final.model

    @property
    def values(self) -> dict[str, float]:
        """Parameter values of the model after tracing, by full name, SI units."""
        return self.model.values

    @property
    def closed(self) -> float:
        """Share of the held-out gap between the base model's error and the noise floor that was closed [1]."""
        errors = ((self.error[side]["holdout"] or {}).get(f"rmse_{self.unit}", np.nan) for side in ("before", "after"))
        before, after = errors
        gap = before - self.error[f"noise_floor_{self.unit}"]
        return float((before - after) / gap) if gap > 0 else 0.0

    def as_json(self) -> dict[str, Any]:
        """The content of `trace.json`; numbers may still be other than finite."""
        found = self.selection
        base = {
            name: {"value": value.value, "std": value.std, "unit": value.unit, "status": value.status}
            for name, value in self.base.model.parameters.items()
        }
        return {
            "format": "valve-trace", "version": 1,
            "base": {"effects": list(found.base.effects), "parameters": base},
            "residual": {
                "white": found.before.white, "p_value": found.before.p_value,
                "noise_floor_m": self.error["noise_floor_m"],
            },
            "candidates": [answer.candidate_row(c, self.holdout_rmse, self.unit) for c in found.candidates],
            "verdict": found.verdict, "effects_added": list(found.added), "same_class": list(found.same_class),
            "unlisted": None if self.residual is None else self.residual.as_json(),
            "error": dict(self.error),
            "residual_after": {"white": found.after.white, "p_value": found.after.p_value},
            "crosscheck": answer.crosscheck_rows(self.final.crosscheck),
            "second_opinion": None if self.second_opinion is None else asdict(self.second_opinion),
        }  # fmt: skip

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `trace.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_text(Path(path), json.dumps(answer.finite(self.as_json()), indent=1, allow_nan=False) + "\n")

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the report, one self-contained HTML page. Raises BadInput when it cannot be written."""
        from identification.report import write_trace_report

        write_trace_report(path, self)

    def plot(self) -> Any:
        """The main pictures, one below the other, as a bokeh layout: ``bokeh.io.show(found.plot())``."""
        from identification.report import stacked

        return stacked(self)

    def sentences(self) -> list[str]:
        """The answer in words."""
        return answer.sentences(self.selection, self.residual, self.second_opinion, self.closed)


def trace(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    given: Mapping[str, float] | None = None,
    hold: bool = False,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Trace:
    """Find what a model of the base effects lacks in recordings: fit, test, add, refit, judge on held-out data.

    recordings : those that are fitted, all of one valve; holdout : recordings that only judge, without any the last
    quarter of each recording; given : parameters that are held, by full name, SI units; hold : the force is held
    between samples; catalogue : the effects that are tried, `CATALOGUE.extended` has effects of your own as well;
    progress : told the stage of the work.

    Raises BadInput for recordings that cannot be used, and NegativeAnswer, with the reason in words, when the base
    model cannot be fitted.
    """
    found = select(recordings, holdout=holdout, given=given, hold=hold, catalogue=catalogue, progress=progress)
    fitted, held_out = free_run_experiments(found.base.data)
    models = [found.base] if found.final is found.base else [found.base, found.final]
    runs = [identification_of(m, recordings, fitted, held_out) for m in tracked(models, "free runs", progress)]
    base, final = runs[0], runs[-1]
    residual = None if found.after.white and found.verdict != "unlisted" else describe_residual(found)
    refits = [(c.effect, c.refit) for c in found.candidates if c.refit is not None]
    rmse = {e: holdout_rmse(m, fitted, held_out) for e, m in tracked(refits, "free runs of candidates", progress)}
    progress("cross-check", 0, 1)
    opinion = None if found.verdict == "none" else second_opinion(found.base)
    progress("cross-check", 1, 1)
    return Trace(found, base, final, rmse, residual, free_run_errors(found.base, found.final, base, final), opinion)
