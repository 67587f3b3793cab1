"""What does a recording teach us? Fit, uncertainty, cross-check and report."""

from identification._crosscheck import Crosscheck, Row, crosscheck
from identification._experiment import Experiment, Segment, experiment
from identification._fit import Fit, Outcome, fit
from identification._identify import identify
from identification._noise import noise_std
from identification._profile import Profile, profile
from identification._result import Identification, Trajectory
from identification._uncertainty import Uncertainty, uncertainty

__all__ = [
    "Crosscheck",
    "Experiment",
    "Fit",
    "Identification",
    "Outcome",
    "Profile",
    "Row",
    "Segment",
    "Trajectory",
    "Uncertainty",
    "crosscheck",
    "experiment",
    "fit",
    "identify",
    "noise_std",
    "profile",
    "uncertainty",
]
