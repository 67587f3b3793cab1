"""What does a recording teach us? Fit, uncertainty, cross-check and report."""

from identification._crosscheck import Crosscheck, Row, crosscheck
from identification._experiment import Experiment, Segment, experiment
from identification._fit import Estimator, Fit, Outcome, fit
from identification._identify import identify
from identification._noise import noise_std
from identification._profile import Profile, profile
from identification._result import Identification, Trajectory
from identification._trace import Candidate
from identification._trace_result import Trace, trace
from identification._uncertainty import Uncertainty, uncertainty

__all__ = [
    "Candidate",
    "Crosscheck",
    "Estimator",
    "Experiment",
    "Fit",
    "Identification",
    "Outcome",
    "Profile",
    "Row",
    "Segment",
    "Trace",
    "Trajectory",
    "Uncertainty",
    "crosscheck",
    "experiment",
    "fit",
    "identify",
    "noise_std",
    "profile",
    "trace",
    "uncertainty",
]
