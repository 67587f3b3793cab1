"""Which candidates a round fits: on chunks only those that refits on the base model's paths leave open."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from traced_valves import screened, traced

from identification.budget import Budget
from identification.estimators.estimate import Estimate
from identification.estimators.noise_aware.best_paths import BestPathsNoiseAware, noise_aware_for
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.tracing import candidates, settings, shortlist
from identification.tracing.judge import Candidate
from identification.tracing.models.base import base_model
from identification.tracing.models.comparison import is_white
from identification.tracing.models.model import Model
from identification.tracing.models.promise import newton_step
from identification.tracing.refine import CandidateFit, gain_of, refit_on_base_paths, refitted
from identification.tracing.screen import Score, screen
from identification.tracing.settings import GAIN_SHARE, MIN_GAIN
from identification.tracing.shortlist import is_imitated, shortlisted_fits


def fitted(base: Model, scores: list[Score]) -> list[CandidateFit]:
    return [fit for group, _ in shortlisted_fits(base, scores, lambda: False, Budget()) for fit in group]


def test_beside_a_complete_base_model_only_imitated_effects_are_fitted_to_chunks():
    base = traced(None).selection.base
    fits = fitted(base, screened(None))
    assert all(is_imitated(base, fit.score) for fit in fits if fit.chunk_fits)


@pytest.mark.slow
def test_beside_a_complete_candidate_only_those_are_fitted_to_chunks_that_gain_about_as_much():
    data = traced("hardening_spring", k3=3e5).selection.base.data
    base = base_model(data.experiments, data.held_out_experiments, data.given, data.catalogue, order="full")
    fits = fitted(base, screen(base))
    best = max(gain_of(base, fit.base_path_refit) for fit in fits)
    on_chunks = [fit for fit in fits if fit.chunk_fits]
    assert "hardening_spring" in [fit.effect for fit in on_chunks]
    assert len(on_chunks) < len(fits)
    assert all(max(f.score.gain, gain_of(base, f.base_path_refit)) > GAIN_SHARE * best for f in on_chunks)


def test_a_refit_ends_early_beside_one_that_gains_far_more():
    base = traced("hardening_spring", k3=3e5).selection.base
    spring = next(s for s in screened("hardening_spring", k3=3e5) if s.effect == "hardening_spring")
    whole, short = refit_on_base_paths(base, spring), refit_on_base_paths(base, spring, least=1e9)
    assert gain_of(base, whole) > gain_of(base, short) + 100


def test_what_leaves_nothing_on_the_base_models_paths_is_not_refitted_on_others():
    base = traced("hardening_spring", k3=3e5).selection.base
    spring = next(s for s in screened("hardening_spring", k3=3e5) if s.effect == "hardening_spring")
    whole, short = refit_on_base_paths(base, spring), refit_on_base_paths(base, spring, least=1e9)
    for near, enough in ((whole, True), (short, False)):
        promised = gain_of(base, near) * base.data.chunk_share
        less, more = (CandidateFit(spring, (whole,), factor * promised, near) for factor in (0.9, 1.1))
        assert (refitted(base, less, MIN_GAIN) is near) == enough
        assert gain_of(base, refitted(base, more, MIN_GAIN)) >= gain_of(base, near)


def test_what_promises_nothing_is_not_begun_on_the_base_models_paths(monkeypatch):
    base = traced("hardening_spring", k3=3e5).selection.base
    spring = next(s for s in screened("hardening_spring", k3=3e5) if s.effect == "hardening_spring")
    begun = descents(monkeypatch)
    assert abs(gain_of(base, refit_on_base_paths(base, spring, least=1e9))) < MIN_GAIN / 2
    assert not begun
    refit_on_base_paths(base, spring)
    assert begun


@pytest.mark.parametrize(("share", "kept"), [(0.2, False), (0.3, True)])
def test_beside_effects_that_leave_nothing_only_what_may_be_beyond_doubt_is_fitted(monkeypatch, share, kept):
    selection, asked = traced("hardening_spring", k3=3e5).selection, list[list[Score]]()
    assert is_white(selection.final)

    def shortlisted(_model: Model, scores: list[Score], *_: object) -> Iterator[tuple[list[CandidateFit], list[Score]]]:
        asked.append(scores)
        yield [], []

    score = Score("backlash", share * settings.CLEAR_GAIN, {})
    monkeypatch.setattr(candidates, "screen", lambda *_: [score])
    monkeypatch.setattr(candidates, "shortlisted_fits", shortlisted)
    for model in (selection.base, selection.final):
        candidates.candidates_of_round(model, Budget())
    assert asked == [[score], [score] if kept else []]


def test_beside_a_refit_that_gained_more_than_its_score_promised_others_of_about_its_score_are_refitted(monkeypatch):
    base, asked = traced("hardening_spring", k3=3e5).selection.base, list[tuple[str, float]]()
    scores = [
        Score(effect, gain, {}) for effect, gain in (("backlash", 60.0), ("sensor_lag", 31.0), ("dead_time", 29.0))
    ]

    def refit(model: Model, score: Score, least: float, _on_chunks: Model | None) -> Model:
        asked.append((score.effect, least))
        return replace(model, estimate=replace(model.estimate, cost=model.cost - 20 * score.gain, loss=2.0))

    monkeypatch.setattr(shortlist, "refit_on_base_paths", refit)
    monkeypatch.setattr(shortlist, "fit_on_chunks", lambda _base, _small, s, *_, **__: CandidateFit(s, (), s.gain))
    fitted(base, scores)
    assert asked == [("backlash", 0.0), ("sensor_lag", 240.0 * GAIN_SHARE)]


def test_however_many_scores_are_above_chance_all_are_refitted_on_the_base_models_paths(monkeypatch):
    selection, asked = traced("hardening_spring", k3=3e5).selection, list[str]()
    effects = selection.base.data.candidates[: settings.CANDIDATES + 3]
    *above, below = (Score(e, 60.0, {}) for e in effects)

    def refit(model: Model, score: Score, _least: float, _on_chunks: Model | None) -> Model:
        asked.append(score.effect)
        return model

    monkeypatch.setattr(shortlist, "refit_on_base_paths", refit)
    monkeypatch.setattr(shortlist, "fit_on_chunks", lambda _base, _small, s, *_, **__: CandidateFit(s, (), s.gain))
    fitted(selection.base, [*above, replace(below, gain=settings.CHANCE_GAIN / 2)])
    assert asked == [s.effect for s in above]


def test_what_the_base_model_promises_by_itself_begins_no_refit_of_a_candidate(monkeypatch):
    """Where slips are short a base model that lacks much promises what no step of it keeps."""
    base, begun = unsettled(traced(None).selection.base), descents(monkeypatch)
    assert newton_step(base.estimate.normal)[1] > MIN_GAIN
    refit_on_base_paths(base, next(s for s in screened(None) if s.effect == "sensor_drift"))
    assert not begun


def descents(monkeypatch) -> list[float]:
    """The costs from which descents are begun from now on; they stay there."""
    begun = list[float]()

    def descend(_: NoiseAware, now: Estimate, *_others: object) -> Estimate:
        begun.append(now.cost)
        return now

    for order in (NoiseAware, BestPathsNoiseAware):
        monkeypatch.setattr(order, "descend", descend)
    return begun


def unsettled(base: Model) -> Model:
    """A base model from which a step to its own end is left."""
    off = base.estimate.theta + np.sqrt(np.diag(base.estimate.covariance))
    found = base.data.estimator(base.effects).along(off, base.estimate.paths, settings.PATH_STEPS)
    assert found is not None
    return replace(base, estimate=found)


def test_a_refit_never_ends_above_its_start(monkeypatch):
    base = traced("hardening_spring", k3=3e5).selection.base
    work = noise_aware_for(base.kernel, base.coordinates, base.data.fitted, [base.estimate.theta], "damped")
    start = work.start(base.estimate.theta)
    assert start is not None
    worse = replace(start, cost=start.cost + 1000.0)
    monkeypatch.setattr(BestPathsNoiseAware, "descend", lambda *_: worse)
    end = work.refit(start.theta, start.paths, settings.STEPS)
    assert end is not None
    assert end.cost < worse.cost - 900.0


@pytest.mark.parametrize(("share", "first"), [(0.8, True), (0.2, False)])
def test_what_explains_most_of_what_is_missing_is_judged_before_anything_is_fitted_to_chunks(monkeypatch, share, first):
    base, on_chunks = traced("hardening_spring", k3=3e5).selection.base, list[str]()
    left = base.estimate.loss - share * (base.estimate.loss - 1.0)
    score = Score("hardening_spring", 60.0, {})

    def refit(model: Model, *_: object) -> Model:
        return replace(model, estimate=replace(model.estimate, cost=model.cost - 1e4, loss=left, outliers=1.0))

    def fit_on_chunks(_base: Model, _small: Model, s: Score, *_: object, **__: object) -> CandidateFit:
        on_chunks.append(s.effect)
        return CandidateFit(s, (), s.gain)

    monkeypatch.setattr(shortlist, "refit_on_base_paths", refit)
    monkeypatch.setattr(shortlist, "fit_on_chunks", fit_on_chunks)
    some, rest = next(shortlisted_fits(base, [score], lambda: False, Budget()))
    assert [fit.effect for fit in some] == ["hardening_spring"]
    assert (on_chunks == []) == first
    assert (rest != []) == first


def judged(monkeypatch, share: float, accepted: Callable[[bool], bool]) -> list[bool]:
    """Which of two candidates are judged, as whether each is the best one; the other one gains a share of its gain.
    accepted : whether one is, that is the best or not.
    """
    base, asked = traced("hardening_spring", k3=3e5).selection.base, list[bool]()
    best, other, *_ = screened("hardening_spring", k3=3e5)
    refit = refit_on_base_paths(base, best)
    weak = replace(refit, estimate=replace(refit.estimate, cost=base.cost - share * gain_of(base, refit)))
    fits = [CandidateFit(best, (), best.gain, refit), CandidateFit(other, (), other.gain, weak)]

    def judge(_model: Model, fit: CandidateFit) -> Candidate:
        asked.append(fit.effect == best.effect)
        return Candidate(fit.effect, fit.gain, {}, accepted=accepted(asked[-1]))

    monkeypatch.setattr(candidates, "judge", judge)
    monkeypatch.setattr(candidates, "shortlisted_fits", lambda *_: iter([(fits, [])]))
    candidates.candidates_of_round(base, Budget())
    return asked


@pytest.mark.parametrize("accepted", [True, False])
def test_what_held_out_data_reject_sets_no_bar_for_the_others(monkeypatch, accepted):
    assert judged(monkeypatch, 0.3, lambda _: accepted) == ([True] if accepted else [True, False])


@pytest.mark.parametrize("complete", [True, False])
def test_beside_one_that_leaves_nothing_only_what_explains_as_much_is_judged(monkeypatch, complete):
    monkeypatch.setattr(candidates, "_is_enough", lambda _, c, __: complete and c.accepted)
    assert judged(monkeypatch, 0.6, lambda is_best: is_best) == ([True] if complete else [True, False])
