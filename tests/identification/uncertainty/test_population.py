"""What many valves teach: outliers at the rate that is promised, pooled intervals that cover, trends."""

from __future__ import annotations

import numpy as np
import pytest

from identification.population import change, outliers, pooled, trend

DEVELOPED_ON = (1,)
"""Seeds that were used while the methods were made; the tests use others."""


def test_of_the_valves_that_are_told_few_are_sound():
    random, false, found = np.random.default_rng(501), [], []
    for _ in range(200):
        errors = random.uniform(0.02, 0.1, 60)
        values = random.normal(0.0, 0.1, 60) + random.normal(0.0, errors)
        values[:4] += 0.8
        told = outliers(values, errors, 0.1).told
        false.append(told[4:].sum() / max(told.sum(), 1))
        found.append(told[:4].mean())
    assert np.mean(false) < 0.1
    assert np.mean(found) > 0.9


def test_a_fleet_of_sound_valves_has_outliers_as_seldom_as_was_promised():
    random = np.random.default_rng(502)
    for n in (10, 40):
        told = [outliers(random.normal(3.0, 0.1, n), np.zeros(n), 0.1).told.any() for _ in range(300)]
        assert np.mean(told) < 0.1 + 3 * np.sqrt(0.1 * 0.9 / 300)


def test_a_valve_that_is_badly_known_is_no_outlier_for_that():
    values, errors = np.r_[np.linspace(0.9, 1.1, 20), 2.0], np.r_[np.full(20, 0.01), 1.0]
    assert not outliers(values, errors).told.any()
    assert outliers(values, np.full(21, 0.01)).told.tolist() == [False] * 20 + [True]


def test_few_valves_or_missing_values_tell_nothing():
    assert not outliers(np.r_[np.zeros(6), 9.0], np.zeros(7)).told.any()
    found = outliers(np.r_[np.linspace(0, 1, 10), np.nan], np.zeros(11))
    assert np.isnan(found.score[-1])
    assert not found.told[-1]
    assert not outliers(np.ones(12), np.zeros(12)).told.any()


@pytest.mark.parametrize(("between", "narrower"), [(0.0, 0.6), (0.05, 0.7), (0.5, 1.01)])
def test_pooled_intervals_cover_the_truth_and_are_narrower_where_valves_are_alike(between, narrower):
    random, covered, widths = np.random.default_rng(503), [], []
    for _ in range(60):
        errors = random.uniform(0.05, 0.3, 10)
        truth = random.normal(1.0, between, 10)
        values = truth + random.normal(0.0, errors)
        found = pooled(values, errors)
        covered.append((found.lower <= truth) & (truth <= found.upper))
        widths.append((found.upper - found.lower) / (2 * 1.645 * errors))
    assert np.mean(covered) > 0.9 - 3 * np.sqrt(0.9 * 0.1 / 600)
    assert np.mean(widths) < narrower


@pytest.mark.slow
def test_the_next_valve_is_where_the_pooled_prior_has_it():
    random, covered = np.random.default_rng(504), []
    for _ in range(200):
        errors = random.uniform(0.05, 0.1, 8)
        truth = random.normal(1.0, 0.2, 9)
        found = pooled(truth[:8] + random.normal(0.0, errors), errors)
        covered.append(abs(truth[8] - found.new_mean) < 1.645 * found.new_std)
    assert 0.84 < np.mean(covered) < 0.99


def test_pooling_needs_three_valves_with_errors():
    assert pooled(np.ones(2), np.ones(2)) is None
    assert pooled(np.ones(4), np.r_[1.0, 1.0, 1.0, 0.0]) is None
    assert pooled(np.r_[np.nan, 1.0, 1.0, 1.0], np.ones(4)) is None


def test_a_trend_has_an_error_that_covers():
    random, covered = np.random.default_rng(505), []
    at = np.arange(6) * 0.5 * 365.25 * 86400.0
    for _ in range(300):
        values = 0.1 * at / (365.25 * 86400.0) + random.normal(0.0, 0.05, 6)
        found = trend(at, values, np.full(6, 0.05))
        covered.append(abs(found.slope - 0.1) < 2.776 * found.std)  # 95 % of Student's distribution with 4 degrees
    assert np.mean(covered) > 0.92
    assert trend(at[:2], np.zeros(2), np.ones(2)) is None
    assert trend(np.zeros(4), np.zeros(4), np.ones(4)) is None


def test_a_change_is_told_by_both_errors():
    assert change(1.0, 0.3, 2.0, 0.4).std == pytest.approx(0.5)
    assert change(1.0, 0.3, 2.0, 0.4).p == pytest.approx(0.0455, abs=1e-3)
