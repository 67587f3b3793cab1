"""What has changed? The adaptive observer of a valve with friction: residual, threshold, decision, and their theory.

`learn` makes from fault-free data the detector to use, a `Watch`; the `Observer` is the method as published.
"""

from detector.alarms import MONTH_S, Evidence, EvidenceState, Promise, learn_evidence
from detector.measurements import WATCHED, Measurement, Measurements
from detector.observer.alarm_rule import AlarmRule
from detector.observer.approximators import Approximator, HighOrder, RadialBasis, ShiftedSigmoids, regressors
from detector.observer.calibration import Calibration
from detector.observer.calibration_fit import calibrate, healthy_residual
from detector.observer.fleet import Fleet, FleetDecisions
from detector.observer.observer import Bounds, Observer, Start
from detector.observer.screening import SampleVerdict, Screening
from detector.observer.state import Decision, Decisions, ObserverState
from detector.observer.velocity import HighPass, Kalman, Measured, SteadyKalman, Velocity
from detector.watch.advice import ADVICE
from detector.watch.by_model import learn_model
from detector.watch.course import WatchCourse
from detector.watch.judgement import KINDS, Judgement
from detector.watch.learning import learn
from detector.watch.state import WatchState
from detector.watch.strokes import LEAST_STROKES, strokes_of
from detector.watch.watch import Watch
from detector.watch.watch_page import WatchedValve, watch_page
from detector.watch.watched import Watched, learn_recordings, watch_recording
from detector.watch.words import described

__all__ = [
    "ADVICE",
    "KINDS",
    "LEAST_STROKES",
    "MONTH_S",
    "WATCHED",
    "AlarmRule",
    "Approximator",
    "Bounds",
    "Calibration",
    "Decision",
    "Decisions",
    "Evidence",
    "EvidenceState",
    "Fleet",
    "FleetDecisions",
    "HighOrder",
    "HighPass",
    "Judgement",
    "Kalman",
    "Measured",
    "Measurement",
    "Measurements",
    "Observer",
    "ObserverState",
    "Promise",
    "RadialBasis",
    "SampleVerdict",
    "Screening",
    "ShiftedSigmoids",
    "Start",
    "SteadyKalman",
    "Velocity",
    "Watch",
    "WatchCourse",
    "WatchState",
    "Watched",
    "WatchedValve",
    "calibrate",
    "described",
    "healthy_residual",
    "learn",
    "learn_evidence",
    "learn_model",
    "learn_recordings",
    "regressors",
    "strokes_of",
    "watch_page",
    "watch_recording",
]
