"""A fit whose time is over ends with what it has, and says so."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from itertools import count

import pytest
from seeded_valves import recorded
from stiff_valves import stem_test

from identification import Outcome, experiment, fit, identify
from identification.budget import Budget, time_is_over

STIFF_TEST = functools.partial(stem_test, 100.0, ("staircase:6", "sine:6"))
"""Recordings whose fit looks at the clock many times."""


def looked_at(times: int) -> Budget:
    """A budget that is over after so many looks at its clock."""
    looks = _clock(times)
    return Budget(100.0, clock=lambda: next(looks))


def _clock(times: int) -> Iterator[float]:
    yield from (0.0 for _ in range(times))
    yield from (1e6 for _ in count())


def test_nothing_is_over_where_no_budget_is_in_force():
    spent = looked_at(1)
    assert not time_is_over()
    with spent.in_force():
        assert time_is_over()
    assert not time_is_over()


@pytest.mark.parametrize(("looks", "recordings"), [(6, lambda: [recorded(2, "mixed:5")]), (4, STIFF_TEST)])
def test_a_fit_ends_with_the_step_at_hand(looks, recordings):
    experiments, short = [experiment(r) for r in recordings()], looked_at(looks)
    with short.in_force():
        early = fit(experiments)
    assert early.outcome is Outcome.OUT_OF_TIME
    assert early.outcome.usable
    assert early.rms > 1.5  # far from noise


@pytest.mark.slow
def test_a_fit_out_of_time_gives_values_and_no_standard_deviations():
    found = identify(stem_test(100.0, ("staircase:40", "sine:60")), budget=1.0, bootstrap=5)
    assert found.fit.outcome is Outcome.OUT_OF_TIME
    assert not found.converged
    assert all(parameter.std is None for parameter in found.model.parameters.values())
    assert found.model.quality["bootstrap"] is None
