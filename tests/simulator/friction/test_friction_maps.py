"""Friction maps and rising static friction: what they are, and least squares that give them back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recordings import BadInput, BadParameter
from simulator.friction import (
    AsymmetricMap,
    CanudasMap,
    CoulombMap,
    ExponentialDwell,
    RationalDwell,
    RootMap,
    StribeckMap,
    TangentialStiffness,
    fit_dwell,
    fit_map,
)

SPEEDS = np.geomspace(1e-4, 0.3, 60)
V = np.concatenate([-SPEEDS[::-1], SPEEDS])
MAPS = [
    CoulombMap(70.0),
    AsymmetricMap(50.0, 65.0, 120.0, 80.0),
    StribeckMap(60.0, 40.0, 150.0, b=200.0, exponent=0.6),
    StribeckMap(60.0, 40.0, 150.0, b=200.0, exponent=2.0),
    CanudasMap(50.0, 30.0, 20.0, b1=300.0, b2=5.0),
    RootMap(60.0, -30.0, 200.0),
]


@pytest.mark.parametrize("true", MAPS, ids=lambda true: type(true).__name__)
def test_least_squares_give_a_map_back(true):
    found = fit_map(type(true), V, true.force(V))
    for name in found.std:
        assert getattr(found.map, name) == pytest.approx(getattr(true, name), rel=1e-4), name


@pytest.mark.parametrize("true", MAPS, ids=lambda true: type(true).__name__)
def test_the_standard_deviations_are_those_of_repeated_fits(true):
    rng = np.random.default_rng(9)
    fits = [fit_map(type(true), V, true.force(V) + rng.normal(size=len(V))) for _ in range(12)]
    names = list(fits[0].std)
    off = np.array([[(getattr(fit.map, n) - getattr(true, n)) / fit.std[n] for n in names] for fit in fits])
    assert 0.5 < np.sqrt(np.mean(off**2)) < 1.6


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.sampled_from(MAPS), st.floats(1e-4, 0.5))
def test_friction_is_against_the_motion_and_nothing_at_rest(model, v):
    up, down, rest = model.force([v, -v, 0.0])
    assert up > 0 > down
    assert rest == 0
    if not isinstance(model, AsymmetricMap):
        assert up == pytest.approx(-down)


def test_the_map_of_the_source_is_that_with_an_exponent_of_one():
    assert StribeckMap(60.0, 40.0, 0.0, 200.0, 1.0).force(V) == pytest.approx(
        (60 + 40 * np.exp(-200 * abs(V))) * np.sign(V)
    )
    level = 60 * np.sign(V) + (100 - 60) * np.exp(-((V / 5e-3) ** 2)) * np.sign(V) + 150 * V  # (2.17)
    assert StribeckMap(60.0, 40.0, 150.0, 200.0, 2.0).force(V) == pytest.approx(level)


def test_the_linear_form_approximates_the_exponential_one_and_is_not_unique():
    # (2.12) for (2.11): within 2 % of its range over the speeds of a drive, and with parameters far apart alike.
    rng = np.random.default_rng(4)
    v = np.linspace(0.01, 0.2, 80)
    true = CanudasMap(50.0, 15.0, 30.0, b1=30.0, b2=4.0).force(v)
    found = fit_map(RootMap, v, true + 0.2 * rng.normal(size=len(v)))
    assert np.abs(found.map.force(v) - true).max() < 0.02 * true.max()
    other = found.equivalent(0.5)
    assert np.sqrt(np.mean((other.force(v) - found.map.force(v)) ** 2)) == pytest.approx(0.5)
    apart = np.array([abs(getattr(other, n) / getattr(found.map, n) - 1) for n in ("a0", "a1", "a2")])
    assert apart.max() > 0.3


def test_what_samples_do_not_tell_is_said():
    with pytest.raises(BadInput, match="the samples do not tell a2, b2"):
        fit_map(AsymmetricMap, SPEEDS, SPEEDS)
    with pytest.raises(BadInput, match="do not tell"):
        fit_map(RootMap, np.full(20, 0.1), np.ones(20))
    with pytest.raises(BadParameter, match="force"):
        fit_map(CoulombMap, V, V[:-1])
    with pytest.raises(BadParameter, match="not finite"):
        fit_map(CoulombMap, V, V * np.nan)


def test_the_spring_of_a_contact():
    contact = TangentialStiffness(100.0, 20e-6)
    assert contact.stiffness == pytest.approx(5e6)
    assert contact.force([-1e-5, 2e-5]) == pytest.approx([50.0, -100.0])
    with pytest.raises(BadParameter, match="displacement 3e-05: it has broken away"):
        contact.force(3e-5)
    with pytest.raises(BadParameter, match="deflection 0"):
        TangentialStiffness(1.0, 0.0).force(0.0)


DWELL = np.geomspace(0.01, 300.0, 25)


@pytest.mark.parametrize(
    "true",
    [ExponentialDwell(100.0, 60.0, 0.3, 0.5), ExponentialDwell(100.0, 60.0, 0.3, 1.0), RationalDwell(90.0, 50.0, 2.0)],
)
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_break_away_forces_give_the_rise_back(true, noise):
    force = true.force(DWELL) + noise * np.random.default_rng(2).normal(size=len(DWELL))
    found, rmse = fit_dwell(type(true), DWELL, force)
    assert (found.ultimate, found.start) == pytest.approx((true.ultimate, true.start), rel=1e-6 if not noise else 0.04)
    assert found.gamma == pytest.approx(true.gamma, rel=1e-5 if not noise else 0.15)
    if isinstance(true, ExponentialDwell):
        assert found.m == pytest.approx(true.m, rel=1e-5 if not noise else 0.1)
    assert rmse == pytest.approx(noise, rel=0.3, abs=1e-6)


def test_the_rise_begins_at_the_start_and_ends_at_the_ultimate_force():
    for model in (ExponentialDwell(100.0, 60.0, 0.3, 1.4), RationalDwell(100.0, 60.0, 2.0)):
        assert model.force([0.0, 1e9]) == pytest.approx([60.0, 100.0])
        assert (np.diff(model.force(DWELL)) >= 0).all()


def test_what_is_no_rise_is_refused():
    for change, said in (({"gamma": 0.0}, "gamma 0"), ({"m": -1.0}, "m -1"), ({"start": -1.0}, "start -1")):
        with pytest.raises(BadParameter, match=said):
            ExponentialDwell(**{"ultimate": 1.0, "start": 0.5, "gamma": 1.0, "m": 1.0, **change})
    for ask in (lambda: RationalDwell(1.0, 0.5, 1.0).force(-1.0), lambda: fit_dwell(RationalDwell, -DWELL, DWELL)):
        with pytest.raises(BadParameter, match="dwell -"):
            ask()
