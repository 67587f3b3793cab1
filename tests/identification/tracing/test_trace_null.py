"""Tracing of weak effects: named though the base model is complete but for them, unless as much is gained by chance."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from traced_valves import screened, traced

from identification.budget import Budget
from identification.tracing.judge import Candidate, judged_by_chance
from identification.tracing.null_bootstrap import null_probability, tail_probability
from identification.tracing.refine import refit_on_base_paths
from identification.tracing.settings import CHANCE_GAIN, LEVEL

TRIALS = 4000


@pytest.mark.slow
def test_a_weak_effect_is_named_though_the_base_model_leaves_only_noise():
    found = traced("friction_drift", r=3e-4)
    assert found.selection.before.white
    assert found.verdict == "friction_drift"
    assert "hardly gained by chance" in found.candidates[0].why


def test_what_an_effect_gains_of_a_complete_model_is_gained_on_null_replicates():
    base = traced(None).selection.base
    drift = next(s for s in screened(None) if s.effect == "friction_drift")
    refit = refit_on_base_paths(base, drift)
    assert refit is not None
    p = null_probability(base, refit, "friction_drift", doubtful=True, budget=Budget())
    assert p is not None
    assert p > LEVEL


def test_a_gain_beyond_doubt_needs_no_null_replicates():
    base = traced(None).selection.base
    better = replace(base, estimate=replace(base.estimate, cost=base.estimate.cost - 1e4))
    assert null_probability(base, better, "hardening_spring", doubtful=False, budget=Budget()) is None


def test_what_there_was_no_time_to_doubt_is_not_named():
    base = traced(None).selection.base
    better = replace(base, estimate=replace(base.estimate, cost=base.estimate.cost - 100.0))
    ticks = itertools.count()
    spent = Budget(1.0, lambda: float(next(ticks)))
    assert null_probability(base, better, "hardening_spring", doubtful=False, budget=spent) == 1.0
    assert not judged_by_chance(Candidate("hardening_spring", 100.0, {}, accepted=True), 1.0).accepted


def test_the_probability_of_a_gain_holds_for_gains_of_one_distribution():
    rng = np.random.default_rng(5)
    for replicates in (1, 3, 6):
        gains = rng.exponential(3 * CHANCE_GAIN, (TRIALS, replicates + 1))
        p = [tail_probability(row[0], row[1:].tolist()) for row in gains]
        for level in (0.5, 0.05):
            assert abs(np.mean(np.array(p) < level) - level) < 4 * np.sqrt(level * (1 - level) / TRIALS)


def test_many_null_replicates_give_the_probability_of_their_mean():
    assert abs(tail_probability(30.0, [10.0] * 10000) - np.exp(-3)) < 1e-3
    assert tail_probability(-5.0, [10.0]) == 1.0
    assert tail_probability(1e6, []) == 1.0
