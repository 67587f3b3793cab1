"""A comparison in one call: two recordings or models in, what changed out."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from typing import Any

from identification.comparison.models import model_comparison
from identification.comparison.recordings import recording_comparison
from identification.comparison.result import ComparisonResult
from identification.data.experiment import Experiment
from identification.summary import html_table
from simulator import ValveModel


@dataclass(frozen=True, repr=False)
class ValveComparison(ComparisonResult):
    """What changed between two recordings or models of one valve."""

    def __repr__(self) -> str:
        return "\n".join(self.sentences())

    def _repr_html_(self) -> str:
        rows = [
            (q.name, q.unit, f"{q.before.value:.4g}", f"{q.after.value:.4g}", f"{q.lower:.3g} to {q.upper:.3g}",
             "yes" if q.changed else "no")
            for q in self.quantities
        ]  # fmt: skip
        heads = ("quantity", "unit", "before", "after", "difference", "changed")
        return html_table(self.sentences()[0], heads, rows)

    def plot(self) -> Any:
        """Before and after over the same axes, one picture below the other, as a bokeh layout."""
        from identification.report import stacked_comparison

        return stacked_comparison(self)

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
