"""Whether a model is complete where the sampling does not resolve the bristle: beside replicates of its own."""

from __future__ import annotations

from stiff_valves import STIFF, stem_test

from identification import experiment
from identification.tracing import settings
from identification.tracing.models.comparison import fitted_whiteness, held_out_whiteness, is_white, whiteness_beside
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


def test_the_true_model_is_complete():
    model = model_of(STIFF)
    assert is_white(model)
    assert abs(fitted_whiteness(model).complete - settings.COMPLETE_LOSS) < 0.1


def test_a_model_of_other_friction_is_not():
    model = model_of(STIFF | {"lugre.fc": 1.15 * STIFF["lugre.fc"], "lugre.fs": 1.15 * STIFF["lugre.fs"]})
    fitted, held_out = fitted_whiteness(model), held_out_whiteness(model)
    assert not fitted.white
    assert not held_out.white
    assert min(fitted.excess, held_out.excess) > 0


def test_nothing_is_complete_beside_which_no_replicate_has_a_solution():
    model = model_of(STIFF)
    assert not whiteness_beside(model.estimate, model.data.fitted, []).white
