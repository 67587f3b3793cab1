"""Models of the stiff valve as a trace holds them."""

from __future__ import annotations

from stiff_valves import STIFF, stem_test

from identification import experiment
from identification.tracing import settings
from identification.tracing.models.model import Model
from identification.tracing.models.trial_data import trial_data
from simulator import BASE, CATALOGUE


def model_of(values: dict[str, float]) -> Model:
    """The base model of some parameters, on recordings of the stiff valve at 100 Hz."""
    fitted, held_out = ([experiment(r)] for r in stem_test(100.0, ("staircase:25", "sine:25")))
    data = trial_data(fitted, held_out, {}, CATALOGUE).damped_for(STIFF)
    work = data.estimator(BASE)
    estimate = work.start(work.coordinates.theta_of(values), settings.STEPS)
    assert estimate is not None
    return Model(BASE, data, estimate)
