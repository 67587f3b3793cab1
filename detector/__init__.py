"""What has changed? The adaptive observer of a valve with friction: residual, threshold, decision, and their theory."""

from detector._approximators import Approximator, HighOrder, RadialBasis, ShiftedSigmoids, regressors
from detector._decision import Rule
from detector._observer import Bounds, Observer, Start
from detector._sample import Quality, Sample, Samples, Screening, Verdict
from detector._state import Decision, Decisions, State
from detector._velocity import HighPass, Kalman, Measured, Motion, SteadyKalman, Velocity

__all__ = [
    "Approximator",
    "Bounds",
    "Decision",
    "Decisions",
    "HighOrder",
    "HighPass",
    "Kalman",
    "Measured",
    "Motion",
    "Observer",
    "Quality",
    "RadialBasis",
    "Rule",
    "Sample",
    "Samples",
    "Screening",
    "ShiftedSigmoids",
    "Start",
    "State",
    "SteadyKalman",
    "Velocity",
    "Verdict",
    "regressors",
]
