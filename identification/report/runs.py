"""The runs that the page draws, with the units it draws them in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.result import FitResult, Trajectory
from recordings import Array

DRAWN = {"m": (1e3, "mm"), "N": (1.0, "N")}
"""SI unit -> factor and unit in which a signal is drawn."""
FINE = 5e-5
"""Residuals below this are drawn in micrometres [m]."""


@dataclass(frozen=True)
class RecordingRun:
    """A recording against the model: its place among them (from 1), whether it was fitted or held out."""

    trajectory: Trajectory
    place: int
    role: str

    @property
    def label(self) -> str:
        """What to call it on the page."""
        return f"{self.place}: {self.trajectory.name} ({self.role})"

    @property
    def error(self) -> Array:
        """Measured minus simulated (n_samples,), in the trajectory's unit, NaN where one is unknown."""
        return self.trajectory.measured - self.trajectory.simulated

    @property
    def known(self) -> int:
        """Number of samples with an error."""
        return int(np.isfinite(self.error).sum())

    @property
    def rms(self) -> float:
        """Root mean square error in `unit`; NaN where nothing is known."""
        return rms(self.error)

    @property
    def relative(self) -> float:
        """Root mean square error over the standard deviation of the measured signal; NaN where that is zero."""
        measured = self.trajectory.measured[np.isfinite(self.trajectory.measured)]
        spread = float(np.std(measured)) if len(measured) else 0.0
        return self.rms / spread if spread > 0 else float("nan")

    @property
    def over_noise(self) -> float:
        """Root mean square error in multiples of the noise floor."""
        return self.rms / self.trajectory.noise if self.trajectory.noise > 0 else float("nan")

    @property
    def actuator_force(self) -> Array:
        """Measured force of the actuator on the stem [N], (n_samples,)."""
        return self.trajectory.measured if self.trajectory.unit == "N" else self.trajectory.force


def runs(identification: FitResult) -> tuple[RecordingRun, ...]:
    """All runs, fitted ones first."""
    both = [(t, "fitted") for t in identification.trajectories] + [(t, "held out") for t in identification.holdout]
    return tuple(RecordingRun(t, place, role) for place, (t, role) in enumerate(both, 1))


def rms(values: Array) -> float:
    """Root mean square of the finite values; NaN when there are none."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else float("nan")


def error_unit(all_runs: tuple[RecordingRun, ...]) -> tuple[float, str]:
    """Factor and unit in which residuals are drawn: micrometres where they are small."""
    unit = all_runs[0].trajectory.unit
    largest = max((r.rms for r in all_runs if np.isfinite(r.rms)), default=0.0)
    return (1e6, "µm") if unit == "m" and largest < FINE else DRAWN[unit]


def output_name(run: RecordingRun) -> str:
    """The signal that the model predicts."""
    return "position" if run.trajectory.unit == "m" else "force"
