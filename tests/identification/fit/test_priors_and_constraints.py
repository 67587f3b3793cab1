"""What a user knows beforehand: priors and constraints in the steps of a fit."""

from __future__ import annotations

import numpy as np
import pytest

import bristle as br
from identification import experiment, fit
from identification.estimators.constraints import Constraint
from identification.estimators.least_squares import FeasibleSet, minimise, weighted
from recordings import BadParameter, Recording


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Ten seconds of an exact force on a valve of fc 150 N and fs 200 N."""
    return br.simulate("mixed:10", given={"spring.K": 4e4}, rate=500, position_noise=2e-6, seed=3)


@pytest.mark.slow
def test_a_prior_far_tighter_than_the_data_wins_and_a_wide_one_changes_nothing(recording):
    plain = fit([experiment(recording)])
    sure = fit([experiment(recording)], priors={"mass.m": (3.0, 1e-6)})
    vague = fit([experiment(recording)], priors={"mass.m": (3.0, 1e3)})
    assert sure.values["mass.m"] == pytest.approx(3.0, abs=1e-4)
    assert vague.values["mass.m"] == pytest.approx(plain.values["mass.m"], rel=1e-3)


@pytest.mark.slow
def test_a_constraint_that_the_data_break_is_kept_at_its_edge(recording):
    plain = fit([experiment(recording)])
    ratio = plain.values["lugre.fs"] / plain.values["lugre.fc"]
    held = fit([experiment(recording)], constraints=[f"lugre.fs>={1.1 * ratio}*lugre.fc"])
    assert held.values["lugre.fs"] / held.values["lugre.fc"] == pytest.approx(1.1 * ratio, rel=1e-6)
    below = fit([experiment(recording)], constraints=["mass.m<=1.5"], given={"lugre.sigma1": 1000.0})
    assert below.values["mass.m"] <= 1.5 * (1 + 1e-9)


def test_rows_are_kept_on_the_way_and_at_the_end():
    seen = []

    def evaluate(theta):
        seen.append(theta.copy())
        return weighted(theta - np.array([2.0, 0.0]), np.eye(2), np.inf)

    limits = FeasibleSet(np.full(2, -5.0), np.full(2, 5.0), np.array([[-1.0, 1.0]]), np.array([0.0]))
    end = minimise(evaluate, np.array([3.0, 0.0]), bounds=limits)
    assert end is not None
    assert end.theta == pytest.approx([1.0, 1.0], abs=1e-6)
    assert all(theta[1] - theta[0] >= -1e-8 for theta in seen)


def test_constraints_are_read_from_text():
    assert Constraint.parse("mass.m <= 5") == Constraint("mass.m", 5.0, "", True)
    assert Constraint.parse("lugre.fs>=lugre.fc") == Constraint("lugre.fs", 1.0, "lugre.fc", False)


@pytest.mark.parametrize(
    ("constraint", "why"),
    [("lugre.fs", "it is no constraint"), ("a.b>=2", "there is no a.b"), ("spring.F0>=lugre.fc", "it compares")],
)
def test_what_is_no_constraint_is_refused(recording, constraint, why):
    with pytest.raises(BadParameter, match=why):
        fit([experiment(recording)], constraints=[constraint])


@pytest.mark.parametrize(
    ("given", "constraints"),
    [
        ({}, ["mass.m>=5", "mass.m<=1"]),
        ({"mass.m": 2.0}, ["mass.m>=5"]),
        ({"spring.K": 0.0}, ["spring.K>=2*lugre.sigma0"]),
    ],
)
def test_what_no_values_keep_is_refused(recording, given, constraints):
    with pytest.raises(BadParameter, match="no values keep them"):
        fit([experiment(recording)], given=given, constraints=constraints)


def test_an_end_beyond_all_numbers_is_refused(recording):
    with pytest.raises(BadParameter, match="it is no constraint"):
        fit([experiment(recording)], constraints=["mass.m>=1e999"])


@pytest.mark.parametrize(("name", "pair"), [("mass.x", (1.0, 1.0)), ("mass.m", (-1.0, 1.0)), ("mass.m", (2.0, 0.0))])
def test_what_is_no_prior_is_refused(recording, name, pair):
    with pytest.raises(BadParameter, match="priors"):
        fit([experiment(recording)], priors={name: pair})
