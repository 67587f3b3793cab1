"""A trace in one call: recordings in, the answer to what a model lacks out."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from identification.budget import Budget
from identification.identified import Identification
from identification.summary import trace_html, trace_text
from identification.tracing.algorithm import select
from identification.tracing.crosscheck import second_opinion
from identification.tracing.models.free_runs import (
    free_run_errors,
    free_run_experiments,
    holdout_rmse,
    identification_of,
)
from identification.tracing.residual import describe_residual
from identification.tracing.result import TraceResult
from recordings import Progress, Recording, silent, tracked
from simulator import CATALOGUE, Catalogue


@dataclass(frozen=True, repr=False)
class Trace(TraceResult):
    """The answer to the question what a model lacks.

    selection : the models under trial and their candidates, as forward selection left them
    base, final : the models before and after, each with free runs, uncertainties and its `model.json`
    holdout_rmse : free-run error of the refitted candidates on the held-out recordings, by effect [`unit`]
    residual : what no candidate explains, in words; None where that is only noise
    error : free-run errors ``before`` and ``after``, on the recordings ``fit``, ``holdout`` and ``report``, which
        neither fitted nor chose anything: ``rmse_m`` [m] and ``nrmse`` [1], or ``rmse_N`` [N] and ``nrmse_N`` [1]
        where the force is predicted; with ``noise_floor_m`` [m] and there ``noise_floor_N`` [N]
    second_opinion : what sparse regression chooses, or None where it can say nothing
    seconds : that the trace took; complete : whether it tried all that it would without a budget

    >>> import bristle as br
    >>> drag = {"effects": ["quadratic_drag"], "given": {"quadratic_drag.c": 2e4}}
    >>> run = br.simulate("sine:30", **drag, position_noise=1e-6, force_noise=0.5, seed=3)
    >>> arrays = {name: run[name].values for name in ("time", "position", "force")}
    >>> rig = br.Recording.from_arrays(**arrays, roles={"position": "input", "force": "output"})
    >>> found = br.trace(rig)
    >>> found.verdict, found.complete
    ('quadratic_drag', True)
    """

    base: Identification
    final: Identification

    def __repr__(self) -> str:
        return trace_text(self)

    def _repr_html_(self) -> str:
        return trace_html(self)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the report, one self-contained HTML page. Raises BadInput when it cannot be written."""
        from identification.report import write_trace_report

        write_trace_report(path, self)

    def plot(self) -> Any:
        """The main pictures, one below the other, as a bokeh layout: ``bokeh.io.show(found.plot())``."""
        from identification.report import stacked

        return stacked(self)


def trace(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    given: Mapping[str, float] | None = None,
    report_on: Sequence[Recording] = (),
    hold: bool = False,
    budget: float = float("inf"),
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Trace:
    """Find what a model of the base effects lacks in recordings: fit, test, add, refit, judge on held-out data.

    recordings : those that are fitted, all of one valve; holdout : recordings that only judge, without any the last
    quarter of each recording; report_on : recordings for the errors before and after that do neither, without any the
    last part of what is held out; given : parameters that are held, by full name, SI units; hold : the force is held
    between samples; budget : seconds after which the best answer so far is given; catalogue : the effects that are
    tried, `CATALOGUE.extended` has effects of your own as well; progress : told the stage of the work.

    Raises BadInput for recordings that cannot be used, and NegativeAnswer, with the reason in words, when the base
    model cannot be fitted.
    """
    time = Budget(budget)
    with time.in_force():
        found = select(
            recordings, holdout=holdout, report_on=report_on, budget=time, given=given, hold=hold, catalogue=catalogue,
            progress=progress,
        )  # fmt: skip
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
    error = free_run_errors(found.base, found.final, base, final, found.report_experiments)
    return Trace(found, base, final, rmse, residual, error, opinion, time.spent)
