"""What a trace found, as one value: what goes into `trace.json` and into the report."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.result import FitResult
from identification.tracing import answer
from identification.tracing.crosscheck import SecondOpinion
from identification.tracing.judge import Candidate
from identification.tracing.residual import ResidualDescription
from identification.tracing.verdict import Selection
from recordings import save_json
from simulator import Catalogue, ValveModel


@dataclass(frozen=True, repr=False)
class TraceResult:
    """What a trace found. `Trace` says what its fields are, and shows it."""

    selection: Selection
    base: FitResult
    final: FitResult
    holdout_rmse: Mapping[str, float]
    residual: ResidualDescription | None
    error: Mapping[str, Any]
    second_opinion: SecondOpinion | None
    seconds: float

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
        """Ids of the accepted effects, the one first without which the model loses most."""
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
    def reported(self) -> str:
        """Which part of the data the errors before and after are reported on: ``report``, where there is such a part,
        or ``holdout``."""
        return "report" if self.selection.report_experiments else "holdout"

    @property
    def complete(self) -> bool:
        """Whether the trace tried all that it would without a budget of time."""
        return not self.selection.not_tried

    @property
    def closed(self) -> float:
        """Share of the gap between the base model's error and the noise floor that was closed [1], on `reported`."""
        where = self.reported
        errors = ((self.error[side][where] or {}).get(f"rmse_{self.unit}", np.nan) for side in ("before", "after"))
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
            "base": {
                "effects": list(found.base.effects), "parameters": base,
                "plant": dict(self.base.model.plant), "noise": dict(self.base.model.noise),
            },
            "residual": {
                "white": found.before.white, "p_value": found.before.p_value,
                "noise_floor_m": self.error["noise_floor_m"],
            },
            "candidates": [answer.candidate_row(c, self.holdout_rmse, self.unit) for c in found.candidates],
            "verdict": found.verdict, "effects_added": list(found.added), "same_class": list(found.same_class),
            "complete": self.complete, "not_tried": list(found.not_tried), "seconds": self.seconds,
            "unlisted": None if self.residual is None else self.residual.as_json(),
            "error": dict(self.error),
            "residual_after": {"white": found.after.white, "p_value": found.after.p_value},
            "crosscheck": answer.crosscheck_rows(self.final.crosscheck),
            "second_opinion": None if self.second_opinion is None else asdict(self.second_opinion),
        }  # fmt: skip

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `trace.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_json(Path(path), self.as_json())

    def sentences(self) -> list[str]:
        """The answer in words."""
        return answer.sentences(self.selection, self.residual, self.second_opinion, self.closed)
