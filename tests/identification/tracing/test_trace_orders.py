"""In which order models are tried, and how they are judged on recordings that were held out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stiff_models import model_of
from stiff_valves import STIFF
from traced_valves import traced

from identification.budget import Budget
from identification.estimators.noise_aware.mending import MANY
from identification.estimators.noise_aware.search import chunks
from identification.tracing import algorithm
from identification.tracing.candidates import in_wrong_order
from identification.tracing.judge import Candidate
from identification.tracing.models.model import Model
from recordings import NegativeAnswer
from simulator import BASE

SOFT = STIFF | {"lugre.sigma0": 2e4}
"""The mass swings on its bristles by one radian from sample to sample at 100 Hz."""


def with_values(model: Model, values: dict[str, float], loss: float) -> Model:
    """A model that says other values, and leaves such a loss."""
    theta = model.coordinates.theta_of(values)
    return replace(model, estimate=replace(model.estimate, theta=theta, loss=loss))


def test_a_swing_shows_where_nodes_resolve_it_and_the_model_explains_most():
    model = model_of(STIFF)
    assert not model.shows_the_swing
    assert with_values(model, SOFT, 1.5).shows_the_swing
    assert not with_values(model, SOFT, 5.0).shows_the_swing
    full = replace(model.data, damped=None)
    assert not replace(with_values(model, SOFT, 1.5), data=full).shows_the_swing


def test_the_best_refit_tells_the_order():
    model = model_of(STIFF)
    soft, stiff = (
        Candidate("backlash", 1e3, {}, refit=replace(m, estimate=replace(m.estimate, cost=cost)))
        for m, cost in ((with_values(model, SOFT, 1.5), -1e6), (model, -1e5))
    )
    assert in_wrong_order([stiff, soft, Candidate("dead_time", 1.0, {})])
    assert not in_wrong_order([stiff])
    assert not in_wrong_order([])


def test_where_a_candidate_shows_the_swing_all_begins_again_in_full_order(monkeypatch: pytest.MonkeyPatch):
    base = model_of(STIFF)
    full = replace(base, data=replace(base.data, damped=None))
    soft, orders = with_values(base, SOFT, 1.5), []
    rounds = {True: (Candidate("backlash", 1e3, {}, refit=soft),), False: ()}
    monkeypatch.setattr(algorithm, "candidates_of_round", lambda model, *_: rounds[model.data.damped is not None])
    monkeypatch.setattr(algorithm, "base_model", lambda *_, order: orders.append(order) or full)
    found, model, added, _ = algorithm.forward_selection(base, Budget())
    assert orders == ["full"]
    assert found is full
    assert model is full
    assert added == ()


def test_where_the_full_order_has_no_fit_the_damped_one_goes_on(monkeypatch: pytest.MonkeyPatch):
    def no_fit(*_: object, order: str):
        raise NegativeAnswer(f"no fit in {order} order")

    base = model_of(STIFF)
    soft = Candidate("backlash", 1e3, {}, refit=with_values(base, SOFT, 1.5))
    monkeypatch.setattr(algorithm, "candidates_of_round", lambda *_: (soft,))
    monkeypatch.setattr(algorithm, "base_model", no_fit)
    found, model, added, rounds = algorithm.forward_selection(base, Budget())
    assert found is model is base
    assert added == ()
    assert rounds == [(soft,)]


@pytest.mark.slow
def test_held_out_recordings_may_move_parameters_within_their_error():
    true = model_of(STIFF)
    weak = np.linalg.eigh(true.estimate.covariance)
    off = true.estimate.theta + 6.0 * np.sqrt(weak[0][-3]) * weak[1][:, -3]
    model = model_of(true.coordinates.values(off))
    held, within = model.held_out, model.held_out_within_error
    assert within.loss < held.loss
    moved = within.theta - model.estimate.theta
    assert 0.0 < moved @ model.estimate.normal.matrix @ moved < held.cost - within.cost


def test_what_other_recordings_told_is_a_prior():
    coordinates = model_of(STIFF).coordinates
    theta = coordinates.theta_of(STIFF)
    precision = np.diag(np.arange(1.0, len(theta) + 1))
    told = replace(coordinates, learned=(theta, precision)).told(theta + 0.1)
    assert told.cost == pytest.approx(0.01 * np.trace(precision))
    np.testing.assert_allclose(told.gradient, 0.1 * np.diag(precision))
    np.testing.assert_allclose(told.matrix, precision)
    assert replace(coordinates, learned=(theta, precision)).all_held().told(np.empty(0)).cost == 0.0


def test_slips_that_paths_miss_are_looked_for_where_a_model_is_judged():
    model = model_of(STIFF)
    late = [np.roll(path, 20, axis=0) for path in model.estimate.paths]
    fitting, judging = (model.data.estimator(BASE, judging=judged) for judged in (False, True))
    missed = fitting.along(model.estimate.theta, late, 0)
    assert missed.outliers > MANY
    assert fitting.mended(missed) is missed
    assert judging.mended(missed).cost < missed.cost - 1000


def test_a_fit_to_chunks_goes_on_along_the_paths_of_the_model_beside_it():
    base = model_of(STIFF)
    data, _ = base.data.on_chunks()
    small = base.on_chunks()
    assert small.data.fitted[0].t.tolist() == data.fitted[0].t.tolist()
    beside = small.refitted_beside(base)
    assert beside.data is base.data
    assert beside.cost < base.cost + 1.0


def test_chunks_of_damped_order_are_those_of_a_fit():
    data, places = model_of(STIFF).data.on_chunks()
    known = chunks(model_of(STIFF).data.fitted)
    assert [grid.t.tolist() for grid in data.fitted] == [grid.t.tolist() for grid in known]
    assert len(places) == len(known)


def test_slips_that_paths_miss_are_looked_for_in_full_order_too():
    model = traced(None).selection.base
    assert model.data.damped is None
    judging = model.data.estimator(model.effects, judging=True)
    missed = judging.along(model.estimate.theta, [np.roll(path, 10, axis=0) for path in model.estimate.paths], 0)
    assert missed.outliers > 0.01
    assert judging.mended(missed).outliers < 1e-3
    assert judging.mended(missed).cost < missed.cost - 1000
