"""Friction models of a valve that a recorded force drives: each simulated by itself, and judged by where it goes.

Only a model that holds a resting stem can be run: one whose friction is a function of the velocity alone has none to
give at rest. So maps are run on LuGre's bristle, of which they are the steady state, and the Leuven model in its
finite-state form. What has no such form is refused, with the reason.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.data.experiment import Experiment, experiment
from identification.data.grid import with_smooth_force
from identification.estimators.fit import fit
from identification.estimators.fitted import Fit
from identification.friction.comparison import HELD_OUT, error_lines, split_of
from identification.given import plant_constants
from identification.result import Trajectory, error_of, free_runs
from identification.shown_findings import ShownFindings
from identification.tracing.models.trial_data import divided
from recordings import BadInput, BadParameter, Progress, Recording, ReportOpening, save_json, silent
from simulator import BASE

if TYPE_CHECKING:
    from identification.report.findings_page import Findings

FLAT: Mapping[str, float] = {"lugre.vs": 1e6, "lugre.fc": 1.0}
"""No Stribeck effect: at every speed of a valve the level is lugre.fs."""


@dataclass(frozen=True)
class FreeModel:
    """A friction model as effects of the simulator. text : in words, with its equation; held : parameters that make it
    the model that it is, SI units.
    """

    id: str
    text: str
    added: tuple[str, ...] = ()
    held: Mapping[str, float] = field(default_factory=dict)


FREE_MODELS: Mapping[str, FreeModel] = {
    one.id: one
    for one in (
        FreeModel("coulomb", "Coulomb (2.3), on a bristle", held={**FLAT, "lugre.sigma2": 0.0}),
        FreeModel(
            "asymmetric",
            "asymmetric Coulomb and viscous (2.4), on a bristle",
            ("asymmetric_coulomb", "asymmetric_viscous"),
            FLAT,
        ),
        FreeModel("stribeck", "Stribeck curve with exponent (2.5), on a bristle", ("stribeck_exponent",)),
        FreeModel("lugre", "LuGre (2.13-2.17)"),
        FreeModel("leuven", "Leuven (2.32-2.35), four elements beside a bristle", ("nonlocal_presliding",)),
    )
}
"""What can be run, by name."""

REFUSED: Mapping[str, str] = {
    "canudas": "it is a function of the velocity and holds no resting stem; stribeck is its like on a bristle",
    "root": "it is a function of the velocity and holds no resting stem; stribeck is its like on a bristle",
    "maxwell-slip": "its elements alone damp no stem before break-away; leuven has them beside a bristle",
    "backlash-like": "no effect of the simulator has its form; leuven has a memory of reversals, too",
    "preisach": "no effect of the simulator has its form: its memory has no fixed number of states",
}
"""Why the others cannot."""


@dataclass(frozen=True, eq=False)
class FreeRow:
    """A model run freely: RMS errors of the position [m] where it was fitted and where it was held out, NaN where it
    diverged; held_out : those runs, none where no fit came out.
    """

    model: FreeModel
    fit: Fit
    fitted_m: float
    held_out_m: float
    held_out: tuple[Trajectory, ...] = ()

    @property
    def name(self) -> str:
        """The model's id."""
        return self.model.id

    @property
    def parameters(self) -> int:
        """How many were fitted."""
        return self.fit.coordinates.n_free

    @property
    def values(self) -> dict[str, float]:
        """Fitted values by full name, SI units; none where nothing came out."""
        free = self.fit.coordinates.free_names
        return {name: value for name, value in self.fit.values.items() if name in free} if self.fit.minimum else {}

    def unit(self, name: str) -> str:
        """The unit of a parameter."""
        kernel = self.fit.kernel
        return kernel.catalogue.parameters(kernel.effects)[name].unit


@dataclass(frozen=True, eq=False, repr=False)
class FreeComparison(ShownFindings):
    """rows : best on held-out data first; split : in words."""

    rows: tuple[FreeRow, ...]
    split: str

    @property
    def best(self) -> FreeRow:
        """The row of least held-out error."""
        return self.rows[0]

    def as_json(self) -> dict[str, Any]:
        """As `write` writes it; null where a run diverged."""
        return {
            "format": "friction-free-run-comparison", "version": 1, "split": self.split,
            "models": [
                {
                    "model": row.name, "text": row.model.text, "outcome": row.fit.outcome.value,
                    "number_of_parameters": row.parameters, "fit_rmse_m": _known(row.fitted_m),
                    "holdout_rmse_m": _known(row.held_out_m), "parameters": row.values,
                }
                for row in self.rows
            ],
        }  # fmt: skip

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON. Raises BadInput when it cannot be written."""
        save_json(Path(path), self.as_json())

    def lines(self) -> list[str]:
        """The errors of every model, as columns of text."""
        rows = error_lines("m", [(r.name, r.parameters, r.fitted_m, r.held_out_m) for r in self.rows])
        return [*rows, self.split]

    def findings(self) -> Findings:
        """What its page shows."""
        from identification.report.findings_page import Findings

        best = self.best
        errors = [
            (row.name, row.model.text, f"{row.parameters}", f"{1e6 * row.fitted_m:.4g}", f"{1e6 * row.held_out_m:.4g}",
             row.fit.outcome.value)
            for row in self.rows
        ]  # fmt: skip
        values = [(name, f"{value:.5g}", best.unit(name)) for name, value in best.values.items()]
        missed = [
            (row.name, run.t, 1e6 * (run.measured - run.simulated)) for row in self.rows for run in row.held_out[:1]
        ]
        if best.held_out:
            why = f"{best.name} follows the held-out motion best, to {1e6 * best.held_out_m:.3g} µm"
            opening = ReportOpening("good", why, self.split, "trace the recordings for what it still lacks")
        else:
            why = "no model can be run freely to the end"
            opening = ReportOpening("watch", why, self.split, "trace the recordings for what these models lack")
        return Findings(
            "Friction models", "Friction models",
            ("RMS error of free runs: from the first sample on only the recorded force enters.",),
            ((("model", "equation", "parameters", "fitted [µm]", "held out [µm]", "fit"), errors),
             (("parameter", "value", "unit"), values)),
            {"What each misses of the held-out motion": ("time [s]", "measured - free run [µm]", missed)},
            opening,
        )  # fmt: skip


def compare_free_runs(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    models: Sequence[str] = tuple(FREE_MODELS),
    given: Mapping[str, float] | None = None,
    hold: bool = False,
    progress: Progress = silent,
) -> FreeComparison:
    """Fit valves with different friction to recordings of a force and the position that it led to, and judge each by
    free runs: from the first sample on, only the recorded force enters.

    recordings, holdout : with position and force; without any held out, the last quarter of each recording judges.
    models : ids of `FREE_MODELS`; given : parameters that are held, SI units; hold : the force is held between samples.
    Raises BadParameter for a model that is not there or that cannot be run, BadInput for recordings that cannot be used
    and such whose motion is imposed.
    """
    for name in models:
        if name in REFUSED:
            found = f"it cannot be run freely: {REFUSED[name]}"
            raise BadParameter("friction", name, found, "leave it out, or compare the force instead of free runs")
        if name not in FREE_MODELS:
            raise BadParameter("friction", name, "there is no such model", f"there are {', '.join(FREE_MODELS)}")
    fitted, judging = ([_driven(one, hold) for one in some] for some in (recordings, holdout))
    if not holdout:
        fitted, judging = divided(fitted, HELD_OUT)
    if not any(one.segments for one in fitted) or not any(one.segments for one in judging):
        raise BadInput("friction", "the recordings are too short to be split", "record longer, or hold one out")
    held = plant_constants(fitted) | dict(given or {})
    rows = []
    for done, name in enumerate(models):
        progress(name, done, len(models))
        rows.append(_row(FREE_MODELS[name], fitted, judging, held))
    return FreeComparison(
        tuple(sorted(rows, key=lambda row: np.nan_to_num(row.held_out_m, nan=np.inf))), split_of(len(holdout))
    )


def _driven(one: Recording, hold: bool) -> Experiment:
    made = experiment(one, hold=hold)
    if made.causality != "force":
        found = "its motion is imposed, so that no force decides where the stem goes"
        raise BadInput(one.label, found, "compare the force instead of free runs", parameter="free_run")
    return made


def _row(
    model: FreeModel, fitted: Sequence[Experiment], judging: Sequence[Experiment], held: Mapping[str, float]
) -> FreeRow:
    found = fit(fitted, effects=(*BASE, *model.added), given={**held, **model.held})
    if not found.outcome.usable:
        return FreeRow(model, found, np.nan, np.nan)
    if found.smooths_force:
        assert found.problem is not None
        fitted, judging = list(found.problem.experiments), with_smooth_force(judging)
    held_out = free_runs(found, judging, fitted=False)
    return FreeRow(model, found, _error(free_runs(found, fitted, fitted=True)), _error(held_out), held_out)


def _error(runs: Sequence[Trajectory]) -> float:
    """RMS over all samples of the free runs [m]; NaN where one diverged."""
    if any(not np.isfinite(run.simulated).any() for run in runs):
        return float("nan")
    return (error_of(runs) or {}).get("rmse_m", float("nan"))


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
