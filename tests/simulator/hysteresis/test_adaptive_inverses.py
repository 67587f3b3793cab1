"""Inverses that learn, the inverse property for any input, and fits of backlash and hysteresis to measured loops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recordings import BadInput, BadParameter
from simulator.backlash import (
    AdaptiveBacklashInverse,
    Backlash,
    BacklashInverse,
    SmoothBacklash,
    fit_backlash,
    fit_smooth_backlash,
)
from simulator.hysteresis import (
    AdaptiveQuadrilateralInverse,
    Quadrilateral,
    QuadrilateralInverse,
    fit_quadrilateral,
)

LINES = {"mt": 0.2, "ct": 1.0, "mb": 0.3, "cb": -1.2, "mr": 2.0, "cr": 1.0, "ml": 1.6, "cl": -1.1}
TURNS = st.lists(st.floats(-2.0, 2.0).map(lambda x: round(x, 3)), min_size=1, max_size=20)
K = np.arange(12_000)
WANTED = 1.6 * np.sin(0.05 * K) + 0.6 * np.sin(0.0721 * K)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(TURNS, st.floats(0.2, 3.0), st.floats(-1.0, -0.01), st.floats(0.01, 1.0))
def test_the_inverse_backlash_inverts_any_piecewise_monotone_input(turns, slope, left, right):
    gap = {"slope": slope, "left": left, "right": right}
    inverse, backlash = BacklashInverse(**gap), Backlash(**gap)
    for wanted in turns:
        got = backlash.update(inverse.update(wanted))
        assert got == pytest.approx(wanted, abs=1e-12)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(TURNS)
def test_the_inverse_hysteresis_inverts_any_piecewise_monotone_input(turns):
    inverse, loop = QuadrilateralInverse(**LINES), Quadrilateral(**LINES)
    for wanted in (2.5, *turns):  # once out of the loop, which initialises it
        got = loop.update(inverse.update(wanted))
        assert got == pytest.approx(wanted, abs=1e-9)


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.floats(0.5, 2.0), st.floats(-0.6, -0.1), st.floats(0.1, 0.6))
def test_the_adaptive_inverse_backlash_learns_what_it_inverts(slope, left, right):
    backlash, inverse = Backlash(slope, left, right), AdaptiveBacklashInverse(1.0, -0.05, 0.05)
    errors = []
    for wanted in WANTED[:4000]:
        got = backlash.update(inverse.update(wanted))
        inverse.learn(got)
        errors.append(abs(got - wanted))
    assert (inverse.slope, inverse.left, inverse.right) == pytest.approx((slope, left, right), abs=1e-3)
    assert max(errors[-500:]) < 1e-3 < max(errors[:500])


def test_every_step_brings_the_estimates_nearer():
    slope, left, right = 1.4, -0.3, 0.2
    backlash, inverse = Backlash(slope, left, right), AdaptiveBacklashInverse(1.0, -0.1, 0.1, gain=1.5)
    apart = []
    for wanted in WANTED[:600]:
        inverse.learn(backlash.update(inverse.update(wanted)))
        off = np.array([inverse.slope - slope, inverse.slope * inverse.right - slope * right,
                        inverse.slope * inverse.left - slope * left])  # fmt: skip
        apart.append(np.linalg.norm(off))
    assert (np.diff(apart) <= 1e-12).all()
    assert apart[-1] < 0.1 * apart[0]


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_the_adaptive_inverse_hysteresis_learns_what_it_inverts(seed):
    rng = np.random.default_rng(seed)
    first = {name: value * rng.uniform(0.7, 1.3) for name, value in LINES.items()}
    loop, inverse, fixed = Quadrilateral(**LINES), AdaptiveQuadrilateralInverse(**first), QuadrilateralInverse(**first)
    plain = Quadrilateral(**LINES)
    ours, theirs = [], []
    for wanted in 1.5 * WANTED:  # which runs along all four lines
        got = loop.update(inverse.update(wanted))
        inverse.learn(got)
        ours.append(got - wanted)
        theirs.append(plain.update(fixed.update(wanted)) - wanted)
    assert np.std(ours[-2000:]) < 0.2 * np.std(theirs[-2000:])
    sides = (inverse.lines.mr, inverse.lines.cr, inverse.lines.ml, inverse.lines.cl)
    assert sides == pytest.approx((2.0, 1.0, 1.6, -1.1), rel=0.02)


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("seed", range(4))
def test_a_backlash_is_fitted(seed, noise):
    rng = np.random.default_rng([seed, 77])
    slope, left, right = rng.uniform(0.5, 2), -rng.uniform(0.1, 0.6), rng.uniform(0.1, 0.6)
    v = np.cumsum(rng.normal(size=400)) * 0.2
    backlash = Backlash(slope, left, right, v[0] * slope)
    u = np.array([backlash.update(x) for x in v]) + noise * rng.normal(size=400)
    found = fit_backlash(v, u)
    assert found[:3] == pytest.approx((slope, left, right), abs=1e-6 if noise == 0 else 0.02)
    assert found.rmse == pytest.approx(noise, rel=0.2, abs=1e-6)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_backlash_like_hysteresis_is_fitted(noise):
    rng = np.random.default_rng(12)
    v = 1.5 * np.sin(0.05 * np.arange(600)) + np.sin(0.021 * np.arange(600))
    smooth = SmoothBacklash(1.5, 3.0, 0.4)
    w = np.array([smooth.update(x) for x in v]) + noise * rng.normal(size=600)
    found = fit_smooth_backlash(v, w)
    assert found[:3] == pytest.approx((1.5, 3.0, 0.4), rel=1e-6 if noise == 0 else 0.05)
    assert found.rmse == pytest.approx(noise, rel=0.2, abs=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_lines_of_a_hysteresis_are_fitted(seed):
    rng = np.random.default_rng([seed, 5])
    k = np.arange(500)
    v = 3.2 * np.sin(0.08 * k) + 0.8 * np.sin(0.31 * k)
    loop = Quadrilateral(**LINES, start=(v[0], 0.0))
    u = np.array([loop.update(x) for x in v])
    first = {name: value * rng.uniform(0.85, 1.15) for name, value in LINES.items()}
    found = fit_quadrilateral(v, u + 1e-3 * rng.normal(size=len(u)), **first)
    assert {name: getattr(found.lines, name) for name in LINES} == pytest.approx(LINES, abs=0.01)
    assert found.rmse < 2e-3


def test_what_cannot_be_learned_is_refused():
    for name, value in (("gain", 2.0), ("least", 2.0), ("scale", 0.0)):
        with pytest.raises(BadParameter, match=f"{name} {value:g}"):
            AdaptiveBacklashInverse(**{name: value})
    with pytest.raises(BadParameter, match="between 3"):
        AdaptiveQuadrilateralInverse(between=3.0, **LINES)
    with pytest.raises(BadParameter, match="gain 0"):
        AdaptiveQuadrilateralInverse(gain=0.0, **LINES)
    v = np.sin(np.arange(50.0))
    for fit in (fit_backlash, fit_smooth_backlash):
        with pytest.raises(BadParameter, match="beside inputs"):
            fit(v, v[:-1])
    with pytest.raises(BadInput, match="does not rise with the input"):
        fit_backlash(v, -v)
    with pytest.raises(BadInput, match="does not move both ways"):
        fit_backlash(np.arange(20.0), np.arange(20.0))
    with pytest.raises(BadInput, match="alpha > 0"):
        fit_smooth_backlash(v, 2 * v)
    with pytest.raises(BadParameter, match="sixteen or more"):
        fit_quadrilateral(v[:8], v[:8], **LINES)
