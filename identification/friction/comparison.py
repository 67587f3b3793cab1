"""Friction models side by side: the same recordings, the same split, one error that none of them was fitted to."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.data.experiment import Experiment, Segment, experiment, imposed
from identification.friction.fit import PLANT, FrictionFit, Stretch, fit_friction
from identification.friction.models import MODELS, FrictionModel, ImposedPath
from identification.shown_findings import ShownFindings
from recordings import BadInput, BadParameter, Progress, Recording, ReportOpening, save_json, silent

if TYPE_CHECKING:
    from identification.report.findings_page import Findings

HELD_OUT = 0.25
"""Share at the end of each recording that judges, where no recording is held out."""
VALVE = tuple(name for name, _ in PLANT)
"""What carries the friction in a valve."""
RIG = ("spring.F0",)
"""A rig without spring and moving mass: a constant."""
_MOST = 4_000
"""Samples that are fitted to at most; a longer recording is thinned."""
_FORGOTTEN = 0.05
"""Share of the travel after which the memory of where it started no longer counts."""


@dataclass(frozen=True, eq=False)
class FrictionRow:
    """A model and its errors: RMS of the force [N] where it was fitted and where it was held out."""

    fit: FrictionFit
    fitted_n: float
    held_out_n: float

    @property
    def name(self) -> str:
        """The model's id."""
        return self.fit.model.id


def error_lines(unit: str, rows: Sequence[tuple[str, int, float, float]]) -> list[str]:
    """Columns of text: name, number of parameters, error where a model was fitted and where it was held out."""
    head = f"{'model':<14}{'parameters':>11}{f'fitted [{unit}]':>12}{f'held out [{unit}]':>14}"
    return [head, *(f"{name:<14}{n:>11}{fitted:>12.4g}{held_out:>14.4g}" for name, n, fitted, held_out in rows)]


@dataclass(frozen=True, eq=False, repr=False)
class FrictionComparison(ShownFindings):
    """rows : best on held-out data first; before_n : the errors without any friction, fitted and held out [N]; split :
    in words; held_out : the stretches that judge, for pictures.
    """

    rows: tuple[FrictionRow, ...]
    before_n: tuple[float, float]
    split: str
    held_out: tuple[Stretch, ...]

    @property
    def best(self) -> FrictionRow:
        """The row of least held-out error."""
        return self.rows[0]

    def as_json(self) -> dict[str, Any]:
        """As `write` writes it."""
        return {
            "format": "friction-comparison", "version": 1, "split": self.split,
            "before": {"fit_rmse_N": self.before_n[0], "holdout_rmse_N": self.before_n[1]},
            "models": [
                {
                    "model": row.name, "text": row.fit.model.text, "number_of_parameters": row.fit.parameters,
                    "fit_rmse_N": row.fitted_n, "holdout_rmse_N": row.held_out_n,
                    "parameters": {n: {"value": value, "unit": unit} for n, (value, unit) in row.fit.values.items()},
                }
                for row in self.rows
            ],
        }  # fmt: skip

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON. Raises BadInput when it cannot be written."""
        save_json(Path(path), self.as_json())

    def lines(self) -> list[str]:
        """The errors of every model, as columns of text."""
        rows = error_lines("N", [(r.name, r.fit.parameters, r.fitted_n, r.held_out_n) for r in self.rows])
        return [*rows, f"without friction: {self.before_n[0]:.4g} and {self.before_n[1]:.4g} N; {self.split}"]

    def findings(self) -> Findings:
        """What its page shows."""
        from identification.report.findings_page import Findings

        best = self.best
        errors = [
            (row.name, row.fit.model.text, f"{row.fit.parameters}", f"{row.fitted_n:.4g}", f"{row.held_out_n:.4g}")
            for row in self.rows
        ]
        fitted, held_out = self.before_n
        errors.append(("none", "before: no friction", "-", f"{fitted:.4g}", f"{held_out:.4g}"))
        values = [(name, f"{value:.5g}", unit) for name, (value, unit) in best.fit.values.items()]
        judged = self.held_out[0]
        x = 1e3 * judged.path.x[judged.counts]
        lines = [("measured", x, judged.u[judged.counts]), (best.name, x, best.fit.force(judged)[judged.counts])]
        why = f"{best.name} predicts the held-out force best, to {best.held_out_n:.3g} N"
        action = "run it freely (compare_free_runs) before you trust it with the motion"
        return Findings(
            "Friction models", "Friction models", ("RMS error of the force; the motion is as recorded.",),
            ((("model", "equation", "parameters", "fitted [N]", "held out [N]"), errors),
             (("parameter", "value", "unit"), values)),
            {"Held-out force over position": ("position [mm]", "force [N]", lines)},
            ReportOpening("good", why, self.split, action),
        )  # fmt: skip


class NoFriction(FrictionModel):
    """Nothing: what the plant alone explains."""

    id, text, linear = "none", "no friction", ()

    def shapes(self, path: ImposedPath) -> tuple[()]:
        return ()

    def columns(self, path: ImposedPath, shapes: Any) -> Any:
        return np.zeros((len(path.t), 0))


def compare_friction(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    models: Sequence[str] = tuple(MODELS),
    plant: Sequence[str] = VALVE,
    hold: bool = False,
    progress: Progress = silent,
) -> FrictionComparison:
    """Fit friction models to the force that recorded motions take, and judge each where it was not fitted.

    recordings, holdout : with position and force; without any held out, the last quarter of each recording judges.
    models : ids of `MODELS`; plant : what is fitted beside the friction, of `VALVE`; hold : the force is held between
    samples. The motion is taken as it was recorded, smoothed, whatever drove it: so no model has to be stable, and a
    valve that stuck shows what its friction held.
    Raises BadParameter for a model that is not there, BadInput for recordings that cannot be used.
    """
    for name in models:
        if name not in MODELS:
            raise BadParameter("friction", name, "there is no such model", f"there are {', '.join(MODELS)}")
    every = [stretch for one in recordings for stretch in _stretches(_moved(one, hold))]
    if holdout:
        fitted, judging = every, [s for one in holdout for s in _stretches(_moved(one, hold))]
    else:
        fitted, judging = [_part(one, judge=False) for one in every], [_part(one, judge=True) for one in every]
    if not fitted or not any(one.counts.any() for one in fitted) or not any(one.counts.any() for one in judging):
        raise BadInput("friction", "the recordings are too short to be split", "record longer, or hold one out")
    plant = tuple(plant)
    rows = []
    for done, name in enumerate(models):
        progress(name, done, len(models))
        rows.append(_row(MODELS[name], fitted, judging, plant))
    before = _row(NoFriction(), fitted, judging, plant)
    rows.sort(key=lambda row: row.held_out_n)
    return FrictionComparison(tuple(rows), (before.fitted_n, before.held_out_n), split_of(len(holdout)), tuple(judging))


def split_of(n_held_out: int) -> str:
    """In words what judges: so many recordings held out, or where there are none the last part of each."""
    if n_held_out:
        return f"{n_held_out} recording{'s' if n_held_out > 1 else ''} held out"
    return f"the last {100 * HELD_OUT:.0f} % of each recording held out"


def _row(
    model: FrictionModel, fitted: Sequence[Stretch], judging: Sequence[Stretch], plant: tuple[str, ...]
) -> FrictionRow:
    found = fit_friction(model, fitted, plant)
    errors = [(found.force(one) - one.u)[one.counts] for one in judging]
    return FrictionRow(found, found.rmse, float(np.sqrt(np.mean(np.concatenate(errors) ** 2))))


def _moved(one: Recording, hold: bool) -> Experiment:
    """A recording with its motion imposed; a force that is missing now and then is only not counted."""
    return imposed(experiment(one, "force" if hold else "motion", hold=hold))


def _stretches(e: Experiment) -> list[Stretch]:
    return [_stretch(s) for s in e.segments]


def _stretch(s: Segment) -> Stretch:
    s = s.part(0, len(s.t), max(1, len(s.t) // _MOST))
    m = s.motion
    far = np.abs(m.x - m.x[0]) > _FORGOTTEN * np.ptp(m.x)
    counts = s.seen & (np.arange(len(s.t)) >= np.argmax(far))
    return Stretch(ImposedPath(s.t, m.x, m.v), m.a, s.u, counts)


def _part(one: Stretch, *, judge: bool) -> Stretch:
    """The same motion with only one side of the split counting: the memory of what judges is that of all before it."""
    last = np.arange(len(one.u)) >= (1 - HELD_OUT) * len(one.u)
    return Stretch(one.path, one.a, one.u, one.counts & (last if judge else ~last))
