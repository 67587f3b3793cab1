"""What has changed? The adaptive observer of a valve with friction: residual, threshold, decision, and their theory.

`learn` makes from fault-free data the detector to use, a `Watch`; the `Observer` is the method as published.
"""

from detector._approximators import Approximator, HighOrder, RadialBasis, ShiftedSigmoids, regressors
from detector._calibration import Calibration, calibrate
from detector._decision import Rule
from detector._false_alarms import Blocks, FalseAlarms, strokes_of
from detector._fleet import Fleet, FleetDecisions
from detector._learning import described, learn
from detector._measurements import USED, Measurements, Row
from detector._observer import Bounds, Observer, Start
from detector._sample import Quality, Sample, Samples, Screening, Verdict
from detector._state import Decision, Decisions, State
from detector._velocity import HighPass, Kalman, Measured, Motion, SteadyKalman, Velocity
from detector._watch import KINDS, Judgement, Watch, WatchState

__all__ = [
    "KINDS",
    "USED",
    "Approximator",
    "Blocks",
    "Bounds",
    "Calibration",
    "Decision",
    "Decisions",
    "FalseAlarms",
    "Fleet",
    "FleetDecisions",
    "HighOrder",
    "HighPass",
    "Judgement",
    "Kalman",
    "Measured",
    "Measurements",
    "Motion",
    "Observer",
    "Quality",
    "RadialBasis",
    "Row",
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
    "Watch",
    "WatchState",
    "calibrate",
    "described",
    "learn",
    "regressors",
    "strokes_of",
]
