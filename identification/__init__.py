"""What does a recording teach us? Fit, uncertainty, cross-check and report."""

from identification.compared import ValveComparison, compare_models, compare_recordings
from identification.data.experiment import Experiment, Segment, experiment
from identification.data.noise import noise_std
from identification.estimators.fit import Estimator, fit
from identification.estimators.fitted import Fit, Outcome
from identification.estimators.order import Order
from identification.friction.comparison import RIG as FRICTION_RIG
from identification.friction.comparison import VALVE as FRICTION_VALVE
from identification.friction.comparison import FrictionComparison, compare_friction
from identification.friction.free_run import FREE_MODELS as FREE_FRICTION_MODELS
from identification.friction.free_run import FreeComparison, compare_free_runs
from identification.friction.models import MODELS as FRICTION_MODELS
from identification.given import free_parameters, with_area, without_effects
from identification.identified import Identification
from identification.parallel import one_thread
from identification.procedure import identify
from identification.result import Trajectory
from identification.sparse_regression.crosscheck import ComparedQuantity, Crosscheck, crosscheck
from identification.tracing import settings as trace_settings
from identification.tracing.judge import Candidate
from identification.tracing.models.given_values import gain_of_values
from identification.tracing_procedure import Trace, trace
from identification.uncertainty.covariance import Uncertainty, uncertainty_of
from identification.uncertainty.profile import Profile, profile
from identification.uncertainty.repeats import Repeats

__all__ = [
    "FREE_FRICTION_MODELS",
    "FRICTION_MODELS",
    "FRICTION_RIG",
    "FRICTION_VALVE",
    "Candidate",
    "ComparedQuantity",
    "Crosscheck",
    "Estimator",
    "Experiment",
    "Fit",
    "FreeComparison",
    "FrictionComparison",
    "Identification",
    "Order",
    "Outcome",
    "Profile",
    "Repeats",
    "Segment",
    "Trace",
    "Trajectory",
    "Uncertainty",
    "ValveComparison",
    "compare_free_runs",
    "compare_friction",
    "compare_models",
    "compare_recordings",
    "crosscheck",
    "experiment",
    "fit",
    "free_parameters",
    "gain_of_values",
    "identify",
    "noise_std",
    "one_thread",
    "profile",
    "trace",
    "trace_settings",
    "uncertainty_of",
    "with_area",
    "without_effects",
]
