"""The stated false-alarm rate against what really happens, where what really happens can be simulated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from detector import Blocks
from recordings import BadInput

MONTH_S = 30 * 86400.0


def correlated(n: int, seed: int) -> np.ndarray:
    """Absolute values of correlated noise: a residual."""
    return np.abs(lfilter([1.0], [1.0, -0.9], np.random.default_rng(seed).normal(size=n)))


def cusum(n: int, seed: int) -> np.ndarray:
    """A CUSUM of noise."""
    sums = np.cumsum(np.random.default_rng(seed).normal(size=n) - 0.5)
    return sums - np.minimum.accumulate(np.minimum(sums, 0.0))


@pytest.mark.parametrize("statistic", [correlated, cusum])
def test_limits_keep_to_the_stated_rate(statistic):
    dt_s, wanted, long = 0.1, 2000.0, statistic(3_000_000, 0)
    largest = long.reshape(-1, 1000).max(axis=1)
    rates = []
    for seed in range(1, 21):
        limit = Blocks.of(statistic(6000, seed), dt_s, strokes=100).limit(wanted)
        rates.append(np.mean(largest > limit) * MONTH_S / (1000 * dt_s))
    assert np.mean(np.array(rates) <= 1.1 * wanted) >= 0.85
    assert np.median(rates) > wanted / 1000.0


def test_a_higher_limit_has_a_lower_rate_and_the_interval_holds_the_estimate():
    blocks = Blocks.of(correlated(6000, 3), 0.1, strokes=60)
    rates = [blocks.rate(limit) for limit in (8.0, 10.0, 12.0)]
    assert rates[0].per_month > rates[1].per_month > rates[2].per_month
    assert all(rate.lower <= rate.per_month <= rate.upper for rate in rates)
    assert "a month" in rates[0].sentence
    assert blocks.rate(blocks.limit(5.0)).upper == pytest.approx(5.0, rel=0.05)


def test_fewer_strokes_make_the_limit_higher_and_too_few_are_refused():
    scores = correlated(6000, 4)
    assert Blocks.of(scores, 0.1, strokes=10).limit(1.0) > Blocks.of(scores, 0.1, strokes=200).limit(1.0)
    with pytest.raises(BadInput, match="to and fro"):
        Blocks.of(scores, 0.1, strokes=7)
    with pytest.raises(BadInput, match="independent blocks"):
        Blocks.of(scores[:150], 0.1, strokes=50)


def test_alarms_in_the_data_are_counted_once_each():
    scores = np.full(1000, 0.1)
    scores[[200, 201, 700]] = 2.0
    assert Blocks.of(scores, 0.1, strokes=20).rate().seen == 2
