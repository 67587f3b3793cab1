"""EMPS as its authors score it (A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019).

They filter the measured position with a Butterworth filter of fourth order at 100 Hz, forward and backward, and take
central differences of it. A model predicts the force from these. They drop the first 49 samples, decimate the predicted
and the recorded force alike (forward and backward through a Chebyshev filter, then one sample of ten), and give the
norm of the difference over that of the recorded force. The recorded force goes through no other filter.

The last samples stay in, and there every one of these filters has to guess what comes next. `END` says how many to drop
for an error without them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, cheby1, filtfilt

from benchmarks.measured_data import DATA, imported
from identification import Identification
from recordings import Array, Recording

FITTED, OFFICIAL = "DATA_EMPS", "DATA_EMPS_PULSES"
"""The file that is fitted, and the one for validation, in which pulses are added."""

STEP_S = 1e-3
CUT_OFF_HZ, ORDER = 100.0, 4
DROPPED, ONE_OF = 49, 10
END = 49
RIPPLE_DB, CHEBYSHEV_ORDER, SHARE = 0.05, 8, 0.8
"""The filter before one sample of ten is kept: its edge is at this share of the new Nyquist frequency."""


@dataclass(frozen=True)
class PublishedModel:
    """A rigid drive. mass [kg]; viscous [N s/m] and coulomb [N], each forward and backward; offset [N]."""

    mass: float
    viscous: tuple[float, float]
    coulomb: tuple[float, float]
    offset: float = 0.0

    def force(self, v: Array, a: Array) -> Array:
        """The force [N] at velocities v [m/s] and accelerations a [m/s^2], (n_samples,) each."""
        viscous, coulomb = (np.where(v >= 0, *both) for both in (self.viscous, self.coulomb))
        return np.asarray(self.mass * a + viscous * v + coulomb * np.sign(v) + self.offset)


SYMMETRIC = PublishedModel(95.1089, (203.5034, 203.5034), (20.3935, 20.3935), -3.1648)
ASYMMETRIC = PublishedModel(95.154, (166.706, 240.424), (20.144, 20.628))
PUBLISHED = {(FITTED, SYMMETRIC): 0.040834, (OFFICIAL, SYMMETRIC): 0.059824, (FITTED, ASYMMETRIC): 0.031117}
"""The relative errors [1] that the authors publish. They give none of the asymmetric model on the official file."""


def measured(name: str) -> Recording:
    """A file of EMPS. Raises BadInput when it is not here."""
    return imported(DATA / f"emps/{name}.mat", "emps")


def filtered(recording: Recording) -> Recording:
    """The recording with its position filtered as the authors do it."""
    position = recording["position"]
    b, a = butter(ORDER, CUT_OFF_HZ, fs=1.0 / STEP_S)
    smooth = np.asarray(filtfilt(b, a, position.values, padlen=3 * ORDER))
    return replace(recording, signals={**recording.signals, "position": replace(position, values=smooth)})


def published_error(model: PublishedModel, recording: Recording, end: int = 0) -> float:
    """Relative error [1] of a published model, by the whole of the authors' procedure; end : last samples to drop."""
    v = np.gradient(filtered(recording).si("position").values, STEP_S)
    return relative_error(recording.si("force").values, model.force(v, np.gradient(v, STEP_S)), end)


def model_error(model: Identification, recording: Recording, end: int = 0) -> float:
    """Relative error [1] of the force that a traced model predicts from the position as it is in the recording."""
    (run,) = model.on([recording], hold=True)  # one stretch without a gap
    return relative_error(run.measured, run.simulated, end)


def relative_error(force: Array, predicted: Array, end: int = 0) -> float:
    """The authors' error [1] of a predicted force [N], (n_samples,) both; end : last samples to drop, too."""
    scored = slice(DROPPED, len(force) - end)
    kept = decimated(force[scored])
    return float(np.linalg.norm(kept - decimated(predicted[scored])) / np.linalg.norm(kept))


def decimated(z: Array) -> Array:
    """What `decimate(z, 10)` of MATLAB makes of z: it keeps the last sample, and every tenth before."""
    b, a = cheby1(CHEBYSHEV_ORDER, RIPPLE_DB, SHARE / ONE_OF)
    smooth = filtfilt(b, a, z, padlen=3 * CHEBYSHEV_ORDER)
    return np.asarray(smooth[(len(z) - 1) % ONE_OF :: ONE_OF])
