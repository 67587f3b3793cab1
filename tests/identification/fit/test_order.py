"""The order of a model: the rule at its edges, and a stiff valve at the rates of a plant, fitted in damped order."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from stiff_valves import STEM_TEST, STIFF, stem_test

from identification import Fit, Identification, Outcome, experiment, fit, identify
from identification.data.grid import grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.search import RIGHT, chunks
from identification.estimators.order import (
    LONGEST,
    RESOLVED,
    RESOLVED_EXACT,
    order_of,
    slip_is_over,
    slip_is_seen,
    sub_step,
    swing,
    turn,
)
from simulator import BASE, kernel

SWING = float(np.sqrt(STIFF["lugre.sigma0"] / STIFF["mass.m"]))
"""2236 rad/s."""
SHORT = ("staircase:12", "sine:12")
"""A stem test of a fifth of the time."""


@pytest.mark.parametrize(("noisy", "limit"), [(True, RESOLVED), (False, RESOLVED_EXACT)])
def test_the_bristle_is_followed_up_to_the_angle_that_the_samples_resolve(noisy, limit):
    assert swing(STIFF) == pytest.approx(SWING)
    assert turn(STIFF, 1 / 200) == pytest.approx(11.18, abs=0.01)
    edge = limit / SWING
    assert order_of(STIFF, 0.999 * edge, noisy=noisy) == "full"
    assert order_of(STIFF, 1.001 * edge, noisy=noisy) == "damped"
    softer = STIFF | {"lugre.sigma0": 0.25 * STIFF["lugre.sigma0"]}
    assert order_of(softer, 1.998 * edge, noisy=noisy) == "full"
    assert order_of(softer, 2.002 * edge, noisy=noisy) == "damped"


@pytest.mark.parametrize("noisy", [True, False])
def test_set_points_a_second_apart_tell_where_the_valve_rests_and_no_more(noisy):
    assert order_of(STIFF, 1.001 * LONGEST, noisy=noisy) == "static"
    assert order_of(STIFF, LONGEST, noisy=noisy) == "damped"


def test_the_sub_step_of_the_damped_order_resolves_the_slip_and_not_the_bristle():
    h = sub_step(STIFF, 1 / 200)
    assert np.sqrt(STIFF["spring.K"] / STIFF["mass.m"]) * h == pytest.approx(0.45)
    assert turn(STIFF, h) > 5
    assert sub_step(STIFF | {"spring.K": 0.0}, 1 / 200) < 1.0


@pytest.mark.parametrize("rate", [20.0, 50.0, 100.0, 200.0, 500.0])
def test_no_sub_step_follows_a_mass_that_samples_do_not_show(rate):
    usual, tiny = (sub_step(STIFF | {"mass.m": m}, 1 / rate) for m in (1.0, 0.01))
    slip = np.sqrt(STIFF["spring.K"] / 1.0)
    assert slip * usual == pytest.approx(0.45)
    assert tiny == pytest.approx(min(usual, 0.45 / (2.0 * rate)))


@functools.cache
def identified(rate: float, courses: tuple[str, ...] = STEM_TEST) -> Identification:
    return identify(stem_test(rate, courses), check=False)


def fitted(rate: float) -> Fit:
    return identified(rate).fit


@pytest.mark.slow
@pytest.mark.parametrize("rate", [200.0, 50.0])
def test_a_stiff_valve_at_the_rates_of_a_plant_is_fitted_in_damped_order(rate):
    found = fitted(rate)
    assert found.order == "damped"
    assert found.kernel.damped
    assert found.outcome is Outcome.CONVERGED
    for name, share in (("spring.K", 3e-3), ("spring.F0", 5e-3), ("lugre.fs", 0.01), ("lugre.fc", 0.03)):
        assert found.values[name] == pytest.approx(STIFF[name], rel=share)


@pytest.mark.slow
def test_it_does_not_end_with_a_heavy_stem_on_overdamped_bristles():
    """There the robust loss has another minimum, a fifth higher: twice the mass, half the viscous friction."""
    for rate in (200.0, 50.0):
        values = fitted(rate).values
        assert values["mass.m"] == pytest.approx(STIFF["mass.m"], rel=0.2)
        assert values["lugre.sigma2"] == pytest.approx(STIFF["lugre.sigma2"], rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate", "estimator", "shares"),
    [
        (200.0, "noise-aware", {"lugre.fc": 3e-3, "lugre.fs": 1e-3, "mass.m": 0.03, "lugre.sigma2": 0.03}),
        (50.0, "noise-aware", {"lugre.fc": 0.01, "lugre.fs": 2e-3, "mass.m": 0.2, "lugre.sigma2": 0.05}),
    ],
)
def test_a_noisy_force_is_estimated_though_a_slip_is_over_before_the_next_sample(rate, estimator, shares):
    found = fitted(rate)
    assert found.estimator == estimator
    assert slip_is_over(found.values, 1 / rate) == (rate == 50.0)
    for name, share in shares.items():
        assert found.values[name] == pytest.approx(STIFF[name], rel=share)


@pytest.mark.parametrize("courses", [SHORT, pytest.param(STEM_TEST, marks=pytest.mark.slow)], ids=["short", "whole"])
def test_what_only_the_course_of_a_slip_tells_is_unresolved_where_a_slip_is_a_jump_between_two_samples(courses):
    assert slip_is_seen(STIFF, 1 / 100)
    assert not slip_is_seen(STIFF, 1 / 50)
    found = identified(50.0, courses)
    for name in ("mass.m", "lugre.sigma2", "lugre.vs", "lugre.sigma0"):
        assert found.uncertainty.status[name] == "unresolved"
        assert "a slip takes about" in found.uncertainty.note[name]
        assert found.model.parameters[name].std is None
    rate = float(found.uncertainty.note["mass.m"].split(" would show it")[0].split()[-1])
    assert slip_is_seen(found.fit.values, 1 / rate)
    assert not slip_is_seen(found.fit.values, 1 / (rate - 11))
    assert found.uncertainty.status["lugre.fs"] == "identified"


def test_a_stretch_that_begins_in_a_slip_is_reached_from_the_last_rest_before_it():
    """A slow sine slides and slips for seconds without a rest that is far from break-away."""
    known = grids([experiment(r) for r in stem_test(100.0, ("sine:90",))])
    coordinates = Coordinates.of(kernel(BASE), {}, 700.0)
    theta = coordinates.theta_of(STIFF)
    whole = noise_aware_for(kernel(BASE), coordinates, known, [theta], "damped")
    stretches = chunks(whole.grids)
    assert len(stretches) > 3
    estimate = replace(whole, grids=stretches).start(theta)
    assert estimate is not None
    assert estimate.loss < RIGHT


@pytest.mark.parametrize("courses", [SHORT, pytest.param(STEM_TEST, marks=pytest.mark.slow)], ids=["short", "whole"])
def test_what_the_sampling_does_not_tell_is_unresolved_and_has_no_interval(courses):
    found = identified(50.0, courses)
    assert found.fit.order == found.model.quality["order"] == "damped"
    assert found.uncertainty.status["lugre.sigma1"] == "unresolved"
    note = found.uncertainty.note["lugre.sigma1"]
    assert "too fast for 50 samples a second" in note
    hertz, rate = (float(words.split()[-1]) for words in (note.split(" Hz")[0], note.split(" would show it")[0]))
    assert hertz == pytest.approx(swing(found.fit.values) / (2 * np.pi), abs=0.5)
    assert turn(found.fit.values, 1 / rate) <= RESOLVED
    assert turn(found.fit.values, 1 / (rate - 101)) > RESOLVED
    value = found.model.parameters["lugre.sigma1"]
    assert (value.status, value.std, value.note) == ("unresolved", None, note)
    assert [sentence for sentence in found.advice if "lugre.sigma1" in sentence and note in sentence]
    assert found.model.parameters["spring.K"].status == "identified"
    assert found.model.parameters["spring.K"].std is not None


@pytest.mark.slow
def test_an_order_that_is_asked_for_is_taken():
    [short] = stem_test(500.0, ("sine:8",), values={"lugre.sigma0": 1e5, "lugre.sigma1": 300.0}, force_noise=0.0)
    assert fit([experiment(short)]).order == "full"
    damped = fit([experiment(short)], order="damped")
    assert damped.order == "damped"
    assert damped.values["spring.K"] == pytest.approx(STIFF["spring.K"], rel=3e-3)


@pytest.mark.slow
def test_where_a_fit_ends_does_not_hang_on_the_last_digits_of_the_times():
    """The search compares runs that stick and slip, and takes other ways when times move by a picosecond."""
    rng, known = np.random.default_rng(1), identified(100.0, SHORT)
    moved = []
    for e in map(experiment, stem_test(100.0, SHORT)):
        later = (replace(s, t=s.t + rng.uniform(-1e-12, 1e-12, len(s.t))) for s in e.segments)
        moved.append(e.with_segments(tuple(later)))
    again = fit(moved)
    told = [name for name, status in known.uncertainty.status.items() if status == "identified"]
    assert len(told) > 5
    for name in told:
        assert again.values[name] == pytest.approx(known.fit.values[name], abs=0.5 * known.uncertainty.std[name])
