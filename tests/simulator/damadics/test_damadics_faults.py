"""Faults, scenarios and what is refused."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from recordings import BadInput
from simulator.damadics import (
    FAULTS,
    LEVELS,
    SCENARIOS,
    Fault,
    Noise,
    Parameters,
    limited,
    run_scenario,
    scenario,
    strengths,
)


def benchmark():
    return [one for one in SCENARIOS.values() if one.benchmark]


def test_there_are_44_benchmark_scenarios_of_19_faults():
    assert len(benchmark()) == 44
    per_fault = Counter(one.faults[0].number for one in benchmark())
    assert per_fault == dict(zip(range(1, 20), (3, 2, 1, 1, 1, 1, 3, 3, 1, 3, 2, 3, 4, 3, 1, 3, 2, 4, 3), strict=True))


def test_the_other_scenarios_are_there_by_name():
    others = {one.name for one in SCENARIOS.values() if not one.benchmark}
    assert others == {"healthy", "chapter5-healthy", "chapter5-f4", "chapter5-f11", "example1"}
    assert all(name == one.name for name, one in SCENARIOS.items())


@pytest.mark.parametrize(
    ("name", "tfd", "thor"),
    [
        ("f1-abrupt-small", 0.0, 1500.0),
        ("f13-incipient", 900.0, 2400.0),
        ("f4-incipient", 3600.0, 5100.0),
        ("f17-incipient", 3600.0, 5100.0),
        ("f5-incipient", 86400.0, 85500.0),
    ],
)
def test_a_scenario_has_the_benchmark_s_times(name, tfd, thor):
    one = scenario(name)
    assert (one.ton, one.tfrom, one.tfd, one.thor, one.sample) == (300.0, 900.0, tfd, thor, 1.0)


def test_a_slow_fault_ends_at_98_percent():
    fault = scenario("f9-incipient").faults[0]
    assert fault.signed(np.array([85500.0]))[0] == pytest.approx(0.979, abs=5e-4)


def test_abrupt_levels_and_directions_are_the_benchmark_s():
    found = {
        one.name: float(one.faults[0].signed(np.array([1000.0]))[0]) for one in benchmark() if "abrupt" in one.name
    }
    assert found["f7-abrupt-small"] == 0.25
    assert found["f16-abrupt-medium"] == 0.5
    assert found["f11-abrupt-big"] == 0.75
    negative = {name.split("-")[0] for name, strength in found.items() if strength < 0}
    assert negative == {"f12", "f14", "f19"}


def test_a_fault_grows_holds_and_goes():
    fault = Fault(4, 0.8, start_s=10.0, development_s=20.0, stop_s=50.0, direction=-1)
    t = np.array([0.0, 9.99, 10.0, 15.0, 30.0, 49.99, 50.0, 60.0])
    np.testing.assert_allclose(fault.signed(t), [0, 0, 0, -0.2, -0.8, -0.8, 0, 0], atol=1e-12)


def test_an_abrupt_fault_is_there_at_its_first_step():
    assert Fault(11, start_s=70.0).signed(np.array([69.9975, 70.0])).tolist() == [0.0, 1.0]


def test_strengths_of_one_fault_add_up_to_its_limits():
    t = np.array([0.0])
    columns = strengths([Fault(1, 0.75), Fault(1, 0.75), Fault(17, 0.6, direction=-1)], t)
    assert columns[0, 0] == 1.0
    assert columns[0, 16] == -0.6
    assert limited(np.full((1, 19), -2.0))[0].tolist() == [-1.0 if kind.both_ways else 0.0 for kind in FAULTS.values()]


def test_every_kind_has_levels_that_exist():
    assert all(mode in LEVELS for kind in FAULTS.values() for mode in kind.modes)
    assert all((kind.development_s > 0) == ("incipient" in kind.modes) for kind in FAULTS.values())


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Fault(0), r"f0: there is no such fault; faults are numbered 1 to 19"),
        (lambda: Fault(20), r"f20: there is no such fault"),
        (lambda: Fault(4, 1.01), r"f4: the strength is 1.01; a strength is 0 to 1"),
        (lambda: Fault(4, -0.5), r"f4: the strength is -0.5"),
        (lambda: Fault(4, float("nan")), r"the strength is nan"),
        (lambda: Fault(1, direction=-1), r"f1: the direction is -1; 'valve clogging' has the direction 1 only"),
        (lambda: Fault(4, direction=2), r"the direction is 2; a direction is 1 or -1"),
        (lambda: Fault(4, start_s=-1.0), r"the start is -1 s; times are finite and not negative"),
        (lambda: Fault(4, development_s=-1.0), r"the development time is -1 s"),
        (lambda: Fault(4, start_s=float("inf")), r"the start is inf s"),
        (lambda: Fault(4, start_s=5.0, stop_s=4.0), r"it stops at 4 s and starts at 5 s"),
        (lambda: Fault.of_level(4, "huge"), r"there is no level 'huge'; levels: small, medium, big, incipient"),
        (lambda: Fault.of_level(99, "big"), r"f99: there is no such fault"),
        (lambda: scenario("f4-incipent"), r"there is none named 'f4-incipent'; nearest names: f4-incipient"),
        (lambda: scenario(""), r"there is none named ''; nearest names: "),
        (lambda: run_scenario("f7-abrupt-midium"), r"nearest names: f7-abrupt-medium"),
        (lambda: run_scenario("healthy", sample=0.001), r"sampling interval: it is 0.001 s; .* 0.0025 s"),
        (lambda: run_scenario("healthy", sample=0.0), r"sampling interval: it is 0 s"),
        (lambda: run_scenario("healthy", sample=0.0033), r"sampling interval: it is 0.0033 s"),
        (lambda: run_scenario("healthy", duration=-1.0), r"duration: it is -1 s"),
        (lambda: run_scenario("healthy", duration=float("nan")), r"duration: it is nan s"),
        (lambda: run_scenario("healthy", duration=1e9), r"duration: .* 1e\+09 samples; at most 5000000"),
        (lambda: run_scenario("healthy", "karnopp"), r"no friction form 'karnopp'; there are play, lugre"),
        (lambda: run_scenario("healthy", noise=True, seed=-1), r"noise: the seed is -1"),
        (lambda: Noise(0, white=-1.0), r"noise: the standard deviation is -1"),
        (lambda: Parameters(mass=0.0), r"parameter mass: the value is 0; it is finite and positive"),
        (lambda: Parameters(viscous=-1.0), r"parameter viscous: the value is -1; it is finite and not negative"),
        (lambda: Parameters(hold_steps=1.5), r"parameter hold_steps: the value is 1.5; it is a whole number"),
        (lambda: Parameters.with_changes({"kp": 40.0}), r"there is no 'kp'; there are stroke"),
    ],
)
def test_what_cannot_be_is_refused_in_words(build, words):
    with pytest.raises(BadInput, match=words):
        build()
