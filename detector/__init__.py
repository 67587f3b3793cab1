"""What has changed? The adaptive observer of a valve with friction: residual, threshold, decision, and their theory.

`learn` makes from fault-free data the detector to use, a `Watch`; the `Observer` is the method as published.
"""

from detector.alarms.rates import Blocks, FalseAlarms, strokes_of
from detector.observer.approximators import Approximator, HighOrder, RadialBasis, ShiftedSigmoids, regressors
from detector.observer.calibration import Calibration, calibrate
from detector.observer.decision import Rule
from detector.observer.fleet import Fleet, FleetDecisions
from detector.observer.observer import Bounds, Observer, Start
from detector.observer.sample import Quality, Sample, Samples, Screening, Verdict
from detector.observer.state import Decision, Decisions, State
from detector.observer.velocity import HighPass, Kalman, Measured, Motion, SteadyKalman, Velocity
from detector.watch.learning import described, learn
from detector.watch.measurements import USED, Measurements, Row
from detector.watch.watch import KINDS, Judgement, Watch, WatchState

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
