"""The noise of a smooth signal is found from its own differences, whatever their order and the spacing of the times."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import quiet_noise, white_noise

RANDOM = np.random.default_rng(3)
T = np.arange(20_000) / 200.0
UNEVEN = np.cumsum(RANDOM.choice([0.003, 0.007], len(T)))


@pytest.mark.parametrize("order", [2, 3, 4, 5])
@pytest.mark.parametrize("times", [None, T, UNEVEN], ids=["no times", "even", "uneven"])
def test_every_order_finds_the_noise_that_was_added(order, times):
    at = T if times is None else times
    signal = 0.02 * np.sin(2.0 * at) + RANDOM.normal(0.0, 1e-4, len(at))
    assert white_noise(signal, order, times) == pytest.approx(1e-4, rel=0.05)


@pytest.mark.parametrize("order", [1, 3, 4])
def test_a_polynomial_of_a_lower_degree_is_no_noise(order):
    smooth = np.polynomial.Polynomial(range(1, order + 1))(T / T[-1])
    assert white_noise(smooth, order) < 1e-12


def test_noise_is_that_of_the_rests_of_a_valve_that_slips_most_of_the_time():
    """Eight slips in a second for eight seconds, and a rest of three, at twenty samples in a second."""
    t = np.arange(0.0, 90.0, 0.05)
    slips = (t % 11.0 > 3.0) & (RANDOM.uniform(size=(20, len(t))) < 0.4)
    noisy = np.cumsum(4e-4 * slips, axis=1) + RANDOM.normal(0.0, 5e-6, slips.shape)
    assert min(white_noise(one, 4, t) for one in noisy) > 5e-5
    found = [quiet_noise(one, 4, t) for one in noisy]
    assert np.mean(found) == pytest.approx(5e-6, rel=0.1)
    assert np.std(found) < 1e-6


@pytest.mark.parametrize("n", [300, 3000, 30_000])
def test_noise_that_is_alike_everywhere_is_measured_on_all_of_it(n):
    noise = [RANDOM.normal(0.0, 1.0, n) for _ in range(50)]
    found, of_all = (np.array([measure(one, 4) for one in noise]) for measure in (quiet_noise, white_noise))
    assert found.mean() == pytest.approx(1.0, abs=0.04)
    assert np.abs(found / of_all - 1).mean() < 0.05


def test_too_few_samples_show_no_noise():
    assert white_noise(np.array([1.0, 5.0, 2.0]), 3) == 0.0
    assert white_noise(np.array([1.0, 5.0, 2.0, 9.0]), 3) > 0.0
