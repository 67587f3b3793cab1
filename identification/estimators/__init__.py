"""How parameters are estimated: output error, noise-aware, and with an imposed motion.

What `identification` itself offers is enough to fit a valve. This door is for those who compare estimators or write
one: the noise-aware estimator with its parts, and the protocol that it shares with that of an imposed motion.
"""

from identification.data.grid import Grid, grids, with_smooth_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate, Innovations, totals
from identification.estimators.imposed_motion.estimator import ImposedMotion
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.linearised_model import (
    AffineModel,
    PathFreedom,
    first_variances,
    kalman_filter,
    linearise_in_parts,
)
from identification.estimators.noise_aware.predictor import KalmanSmoother, Predictor
from identification.estimators.noise_aware.search import best_on_chunks, on_whole_recordings
from identification.estimators.output_error.damped import search_for
from identification.estimators.path_estimator import PathEstimator

__all__ = [
    "AffineModel",
    "Coordinates",
    "Estimate",
    "Grid",
    "ImposedMotion",
    "Innovations",
    "KalmanSmoother",
    "NoiseAware",
    "PathEstimator",
    "PathFreedom",
    "Predictor",
    "best_on_chunks",
    "first_variances",
    "grids",
    "kalman_filter",
    "linearise_in_parts",
    "noise_aware_for",
    "on_whole_recordings",
    "search_for",
    "totals",
    "with_smooth_force",
]
