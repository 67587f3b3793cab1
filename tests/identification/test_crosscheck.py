"""The second opinion: sparse regression agrees with a right fit, and disagrees with a wrong one in a sentence."""

from __future__ import annotations

import pytest
from seeded_valves import fitted, recorded

from identification import ComparedCoefficient, Crosscheck, Outcome, crosscheck, experiment, fit, identify
from simulator import random_valve


@pytest.mark.parametrize(
    ("given", "row"),
    [
        ({"spring.K": 1.1}, "spring.K"),
        pytest.param({"lugre.fc": 1.15, "lugre.fs": 1.15}, "bristle force", marks=pytest.mark.long),
        ({"mass.m": 2.0}, "mass.m"),
    ],
)
def test_it_disagrees_with_a_fit_that_was_held_off_the_truth(given, row):
    truth = random_valve(2)[0]
    held = {name: factor * truth[name] for name, factor in given.items()}
    found = identify([recorded(2, "mixed:10", 250.0)], given=held)
    assert found.crosscheck is not None
    assert not found.crosscheck.agrees
    assert row in {r.name for r in found.crosscheck.rows if not r.agrees}
    assert "disagrees" in found.crosscheck.sentence
    assert found.model.quality["crosscheck"] == found.crosscheck.sentence


def test_a_parameter_the_fit_hardly_knows_decides_nothing():
    prepared, found, known = fitted(2, "mixed:40")
    vague = {name: (10.0 * abs(found.values[name])) for name in known.names}
    check = crosscheck(found, [prepared], vague)
    assert check is not None
    assert [row.name for row in check.rows if row.counts] == ["bristle force"]


def test_a_slow_ramp_shows_too_little_to_compare_mass_and_viscous_friction():
    found = identify([recorded(1, "ramp:60", 20.0)])
    if found.crosscheck is not None:
        counted = {row.name for row in found.crosscheck.rows if row.counts}
        assert not counted & {name for name, status in found.uncertainty.status.items() if status == "weak"}
        assert found.crosscheck.agrees
    assert found.uncertainty.status["mass.m"] == "weak"


def test_it_can_be_left_out():
    found = identify([recorded(2)], check=False)
    assert found.crosscheck is None
    assert found.model.quality["crosscheck"] is None


def test_there_is_none_for_a_fit_without_values():
    still = recorded(2)
    prepared = experiment(still)
    nothing = fit([prepared], given={})
    refused = type(nothing)(Outcome.NO_MOTION, nothing.kernel, nothing.coordinates)
    assert crosscheck(refused, [prepared]) is None


def test_rows_and_sentence_tell_the_worst_difference():
    rows = (
        ComparedCoefficient("spring.K", "N/m", 100.0, 101.0, 0.02, True),
        ComparedCoefficient("lugre.sigma2", "N s/m", 100.0, 150.0, 0.25, True),
        ComparedCoefficient("mass.m", "kg", 0.0, 5.0, 0.3, False),
    )
    check = Crosscheck(rows, ("x", "v"), 0.01)
    assert [row.agrees for row in rows] == [True, False, True]
    assert not check.agrees
    assert "lugre.sigma2 differs by +50 %" in check.sentence
    assert "25 %" in check.sentence
    assert Crosscheck(rows[:1], ("x",), 0.01).sentence.startswith("sparse regression agrees")
