"""How well the model follows the data, judged once for the sentences, the cards and the colours of the page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.estimators.fitted import Outcome
from identification.report.runs import RecordingRun, rms, runs
from identification.result import FitResult

FAR_BELOW, AT_FLOOR, NEAR_FLOOR = 0.5, 1.1, 2.0
"""Residual over noise floor below which the floor is doubtful, up to which the model explains all of the data, and up
to which it explains nearly all."""


@dataclass(frozen=True)
class FitQuality:
    """ratio : residual of the fit over the noise floor; free, held_out : the same of the free runs on the fitted and on
    the held-out recordings (None: there are none); window [s] : after which the fit set the motion back to the data
    (None: never; then ratio and free are one).
    """

    ratio: float
    free: float
    held_out: float | None
    window: float | None

    @property
    def mood(self) -> str:
        """Good at the noise floor, a warning near it or where it is unknown, else bad."""
        if self.ratio <= AT_FLOOR:
            return "good"
        return "warn" if self.ratio <= NEAR_FLOOR or not np.isfinite(self.ratio) else "bad"


def fit_quality(identification: FitResult) -> FitQuality:
    """How well an identification fits, against the noise."""
    every, path = runs(identification), identification.fit.minimum
    fitted, held_out = ([r for r in every if r.role == role] for role in ("fitted", "held out"))
    window = path.setting.window if path is not None and np.isfinite(path.setting.window) else None
    free = over_noise(fitted)
    ratio = identification.fit.rms if window is not None else free
    return FitQuality(ratio, free, over_noise(held_out) if held_out else None, window)


def over_noise(some: list[RecordingRun]) -> float:
    """Root mean square error in multiples of the noise over several runs."""
    return rms(np.concatenate([r.error / (r.trajectory.noise or np.nan) for r in some]))


def page_mood(identification: FitResult) -> str:
    """The mood of the whole page: its worst news."""
    check, outcome = identification.crosscheck, identification.fit.outcome
    if outcome is Outcome.NOT_EXPLAINED:
        return "bad"
    doubt = outcome is not Outcome.CONVERGED or (check is not None and not check.agrees)
    return "warn" if doubt or fit_quality(identification).mood == "bad" else "good"
