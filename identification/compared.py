"""A comparison in one call: two recordings or models in, what changed out."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields

from identification.comparison.models import model_comparison
from identification.comparison.recordings import recording_comparison
from identification.comparison.result import ComparisonResult
from identification.data.experiment import Experiment
from simulator import ValveModel


@dataclass(frozen=True)
class ValveComparison(ComparisonResult):
    """What changed between two recordings or models of one valve."""

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the page, one self-contained HTML file. Raises BadInput when it cannot be written."""
        from identification.report import write_comparison_report

        write_comparison_report(path, self)


def compare_recordings(before: Experiment, after: Experiment, repeatability: float = 0.0) -> ValveComparison:
    """Two recordings of one valve: `recording_comparison`."""
    return _shown(recording_comparison(before, after, repeatability))


def compare_models(
    before: ValveModel, after: ValveModel, names: tuple[str, str], repeatability: float = 0.0
) -> ValveComparison:
    """Two models of one valve, of files with these names: `model_comparison`."""
    return _shown(model_comparison(before, after, names, repeatability))


def _shown(found: ComparisonResult) -> ValveComparison:
    return ValveComparison(**{field.name: getattr(found, field.name) for field in fields(found)})
