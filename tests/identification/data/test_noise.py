"""Noise levels from the recording itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from seeded_valves import QUIET, recorded

from identification import experiment, noise_std
from simulator import random_valve

T = np.linspace(0.0, 20.0, 10000)
SLOW = 0.01 * np.sin(2 * np.pi * 0.2 * T) + 0.002 * T


@pytest.mark.parametrize("size", [1e-7, 1e-5, 1e-3])
def test_white_noise_on_a_slow_motion_is_measured(size):
    noisy = SLOW + np.random.default_rng(1).normal(0.0, size, len(T))
    assert noise_std(noisy) == pytest.approx(size, rel=0.05)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), spread=st.floats(0.0, 0.9))
def test_uneven_sampling_does_not_pass_as_noise(seed, spread):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(1 - spread, 1 + spread, 4000) * 2e-3)
    noisy = 0.01 * np.sin(2 * np.pi * t) + rng.normal(0.0, 3e-6, len(t))
    assert noise_std(noisy, t=t) == pytest.approx(3e-6, rel=0.12)


def test_a_few_jumps_do_not_count():
    steps = np.where(np.arange(len(T)) % 1000 < 500, 0.0, 0.02)
    noisy = steps + np.random.default_rng(2).normal(0.0, 1e-5, len(T))
    assert noise_std(noisy) == pytest.approx(1e-5, rel=0.05)


def test_missing_samples_are_passed_over():
    noisy = SLOW + np.random.default_rng(3).normal(0.0, 1e-5, len(T))
    noisy[::11] = np.nan
    assert noise_std(noisy) == pytest.approx(1e-5, rel=0.1)


@pytest.mark.parametrize("every", [2, 5])
def test_a_sensor_slower_than_the_others_is_no_cleaner(every):
    """Beside a faster force, a slow position is missing in most samples."""
    noisy = SLOW + np.random.default_rng(4).normal(0.0, 1e-5, len(T))
    noisy[np.arange(len(T)) % every != 0] = np.nan
    assert noise_std(noisy, t=T) == pytest.approx(1e-5, rel=0.1)


@pytest.mark.parametrize("declared", [True, False])
def test_a_quantisation_step_is_the_least_noise(declared):
    step = 1e-5
    quantised = np.round(SLOW / step) * step
    found = noise_std(quantised, step if declared else 0.0)
    assert step / np.sqrt(12) == pytest.approx(found, rel=1e-9)


@pytest.mark.parametrize("value", [0.0, 0.01, -7.0, 1e9])
def test_a_constant_has_next_to_no_noise(value):
    assert noise_std(np.full(1000, value)) <= 1e-12 * abs(value)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_few_samples_are_no_error(n):
    assert np.isfinite(noise_std(np.arange(float(n))))
    assert noise_std(np.full(n, np.nan)) == 0.0


@settings(max_examples=50, deadline=None)
@given(factor=st.floats(1e-6, 1e6), offset=st.floats(-1e3, 1e3))
def test_noise_scales_with_the_unit_and_ignores_the_offset(factor, offset):
    noisy = np.random.default_rng(4).normal(0.0, 1.0, 500)
    assert noise_std(factor * noisy + factor * offset) == pytest.approx(factor * noise_std(noisy), rel=1e-6)


def test_an_experiment_measures_both_noises():
    seed = 4
    prepared = experiment(recorded(seed))
    assert prepared.noise_position == pytest.approx(QUIET * random_valve(seed)[1], rel=0.05)
    assert prepared.output_noise == prepared.noise_position
    assert prepared.noise_force < 1e-3 * np.std(prepared.segments[0].u)
