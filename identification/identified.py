"""An identified valve: what a fit found, with the ways to show it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from identification.result import FitResult
from identification.summary import fit_html, fit_text


@dataclass(frozen=True, repr=False)
class Identification(FitResult):
    """An identified valve: a fit, how well its parameters are known, and its free runs.

    fit : see `Fit`; uncertainty : of its parameters; model : the valve as `model.json` has it, ``model.write(path)``;
    trajectories, holdout : free runs against the fitted recordings and those held out; crosscheck : against sparse
    regression, None where that was not asked for; advice : what to record to know weak parameters
    better, in sentences.
    """

    def __repr__(self) -> str:
        return fit_text(self)

    def _repr_html_(self) -> str:
        return fit_html(self)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the report, one self-contained HTML page. Raises BadInput when it cannot be written."""
        from identification.report import write_report

        write_report(path, self)

    def plot(self) -> Any:
        """The main pictures, one below the other, as a bokeh layout: ``bokeh.io.show(found.plot())``."""
        from identification.report import stacked

        return stacked(self)
