"""An identified valve: what a fit found, with the ways to show it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from identification.data.close_motion import closely_imposed
from identification.data.experiment import experiment
from identification.data.grid import with_smooth_force
from identification.result import FitResult, Trajectory, free_runs
from identification.summary import fit_html, fit_text
from recordings import BadInput, Recording


@dataclass(frozen=True, repr=False)
class Identification(FitResult):
    """An identified valve: a fit, how well its parameters are known, and its free runs.

    fit : see `Fit`; uncertainty : of its parameters; model : the valve as `model.json` has it, ``model.write(path)``;
    trajectories, holdout : free runs against the fitted recordings and those held out; crosscheck : against sparse
    regression, None where that was not asked for; advice : what to record to know weak parameters
    better, in sentences; repeats : of one test, None where the recordings were not said to be.

    >>> import bristle as br
    >>> found = br.fit(br.simulate("mixed:10", position_noise=2e-6, seed=3), crosscheck=False)
    >>> found.model.parameters["spring.K"].status, len(found.trajectories)
    ('identified', 1)
    """

    def __repr__(self) -> str:
        return fit_text(self)

    def _repr_html_(self) -> str:
        return fit_html(self)

    def on(self, recordings: Sequence[Recording], *, hold: bool = False) -> tuple[Trajectory, ...]:
        """Its free runs on other recordings, one each, as it was fitted: from the force, or from an imposed motion.

        hold : the force is held between samples. Raises BadInput for recordings that cannot be used.
        """
        if self.fit.problem is None:
            raise BadInput("model", "has no free run", "fit it to recordings that move it")
        causality = self.fit.kernel.causality
        experiments = [experiment(r, hold=hold) for r in recordings]
        if causality == "force" and any(e.causality == "motion" for e in experiments):
            raise BadInput("recordings", "have an imposed motion, and the model a driving force", "fit one to them")
        if causality == "motion":
            experiments = [closely_imposed(e) for e in experiments]
        elif self.fit.smooths_force:
            experiments = with_smooth_force(experiments)
        return free_runs(self.fit, experiments, fitted=False)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the report, one self-contained HTML page. Raises BadInput when it cannot be written."""
        from identification.report import write_report

        write_report(path, self)

    def plot(self) -> Any:
        """The main pictures, one below the other, as a bokeh layout: ``bokeh.io.show(found.plot())``."""
        from identification.report import stacked

        return stacked(self)
