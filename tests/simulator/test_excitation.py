"""What excitations ask of a valve: repeatable, within the stroke, and each with the property it is there for."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import BadInput
from simulator import Excitation, Sensors, random_valve, simulate
from simulator.excitation import HIGH, LOW, MIXED, SHAPES, force_demand

DURATION = 20.0
T = np.linspace(0.0, DURATION, 10001)
VALVE = {"spring": 5e4, "preload": 300.0, "stroke": 0.03, "friction": 150.0}


def demand(name: str, seed: int = 1) -> np.ndarray:
    return SHAPES[name](T, DURATION, np.random.default_rng(seed))


def force(text: str, t: np.ndarray = T, seed: int = 1) -> np.ndarray:
    return force_demand(Excitation.parse(text), t, seed=seed, **VALVE)


@pytest.mark.parametrize("name", SHAPES)
def test_a_seed_repeats_it(name):
    assert np.array_equal(demand(name), demand(name))
    assert np.array_equal(force(f"{name}:20"), force(f"{name}:20"))


@pytest.mark.parametrize("name", ["step", "staircase"])
def test_another_seed_asks_for_something_else(name):
    assert not np.array_equal(demand(name, 1), demand(name, 2))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", [name for name in SHAPES if name != "presliding"])
def test_it_stays_in_its_part_of_the_stroke_and_uses_it(name, seed):
    asked = demand(name, seed)
    assert asked.min() >= LOW - 1e-12
    assert asked.max() <= HIGH + 1e-12
    assert np.ptp(asked) > 0.25


def test_a_step_goes_up_once_and_down_once():
    changes = np.diff(demand("step"))
    assert np.count_nonzero(changes) == 2
    assert changes.max() == pytest.approx(-changes.min())
    assert changes.max() > 0.3


def test_a_staircase_rests_on_ten_levels():
    asked = demand("staircase")
    assert len(np.unique(asked)) == 10
    rests = np.diff(np.flatnonzero(np.diff(asked)))
    assert np.all(np.abs(rests - 1000) <= 1)


def test_a_ramp_is_one_slow_stroke_up_and_down():
    asked = demand("ramp")
    assert asked[0] == pytest.approx(LOW)
    assert asked[-1] == pytest.approx(LOW)
    assert asked.max() == pytest.approx(HIGH)
    assert np.allclose(np.abs(np.gradient(asked, T))[10:4990], 2 * (HIGH - LOW) / DURATION)


def test_a_sine_has_four_periods_and_starts_at_the_low_end():
    asked = demand("sine")
    assert np.count_nonzero(np.diff(asked > 0.5)) == 8
    assert asked[0] == pytest.approx(LOW)


def test_a_multisine_has_thirty_equal_lines_and_a_low_crest_factor():
    signal = demand("multisine")[:-1] - 0.5
    lines = np.abs(np.fft.rfft(signal)) / len(signal)
    assert np.allclose(lines[1:31], lines[1:31].mean(), rtol=1e-6)
    assert np.all(lines[31:] < 1e-9 * lines[1])
    crest = np.abs(signal).max() / np.sqrt(np.mean(signal**2))
    assert crest < 1.8
    rng = np.random.default_rng(1)
    by_chance = [np.cos(np.outer(2 * np.pi * T / DURATION, np.arange(1, 31)) + rng.uniform(0, 2 * np.pi, 30)).sum(1)
                 for _ in range(20)]  # fmt: skip
    assert crest < 0.8 * np.median([np.abs(s).max() / np.std(s) for s in by_chance])


def test_a_chirp_rises_in_frequency_and_falls_in_amplitude():
    asked = demand("chirp") - 0.5
    crossings = T[np.flatnonzero(np.diff(np.sign(asked)))]
    half_periods = np.diff(crossings)
    assert np.all(np.diff(half_periods[1:]) < 0.01)
    assert half_periods[-1] == pytest.approx(0.5 / 3.0, rel=0.1)
    assert np.abs(asked[-1000:]).max() < 0.3 * np.abs(asked[:5000]).max()


@pytest.mark.parametrize("seed", range(6))
def test_presliding_never_breaks_the_stem_away(seed):
    """The bristles bend and nothing slides: the stem moves by what their stiffness gives, and some creep."""
    values, stroke = random_valve(seed)
    _, truth = simulate(values, Excitation.parse("presliding:6"), Sensors(rate=1000.0), stroke=stroke, seed=seed)
    swing = np.ptp(truth["force"])
    assert swing < 1.3 * values["lugre.fs"]
    elastic = swing / (values["lugre.sigma0"] + values["spring.K"])
    assert elastic < np.ptp(truth["position"]) < 1.4 * elastic


@pytest.mark.parametrize("seed", [2, 7, 11, 15])
def test_a_positioner_brings_the_stem_to_every_level_of_its_staircase(seed):
    values, stroke = random_valve(seed)
    _, truth = simulate(values, Excitation.parse("positioner:40"), Sensors(), stroke=stroke, seed=seed)
    t = np.arange(len(truth["position"])) / 500.0
    levels = SHAPES["staircase"](t, 40.0, np.random.default_rng(seed)) * stroke
    before_each_change = (np.arange(1, 11) * 2000) - 5
    missed = np.abs(truth["position"] - levels)[before_each_change] / stroke
    assert np.max(missed) < 0.03


@pytest.mark.parametrize("seed", range(12))
def test_a_positioner_is_stable_with_every_valve(seed):
    values, stroke = random_valve(seed)
    _, truth = simulate(values, Excitation.parse("positioner:10"), Sensors(rate=250.0), stroke=stroke, seed=seed)
    assert -0.2 * stroke < truth["position"].min() <= truth["position"].max() < 1.2 * stroke


def test_force_overcomes_friction_at_both_ends():
    """A slow sine brings the stem to 90 % against its friction, and below 10 % on the way back."""
    values, stroke = random_valve(2)
    _, truth = simulate(values, Excitation.parse("sine:20"), Sensors(), stroke=stroke)
    assert truth["position"].max() > 0.88 * stroke
    assert truth["position"][2000:].min() < 0.12 * stroke


def test_a_sequence_is_its_parts_one_after_the_other():
    both, t = force("step:10,sine:10"), T
    assert np.allclose(both[:4990], force("step:10", t[t <= 10.0])[:4990])
    assert Excitation.parse("step:5,sine:20").duration == 25.0
    assert Excitation.parse("mixed:40").parts == tuple((name, 10.0) for name in MIXED)
    assert Excitation.parse("sine").duration == 20.0
    assert Excitation.parse("positioner:7").closed_loop
    assert not Excitation.parse("mixed:7").closed_loop


def test_the_force_changes_as_a_chamber_fills():
    """Steps of the demand pass a lag of 20 ms: 63 % of the way after 10 samples at 500 Hz."""
    stepped = force("step:20")
    start = int(np.flatnonzero(np.abs(np.diff(stepped)) > 1e-9)[0])
    rise = (stepped[start + 10] - stepped[start]) / (stepped[start + 1000] - stepped[start])
    assert rise == pytest.approx(1 - np.exp(-1), abs=0.01)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wobble:3", "no such shape"),
        ("", "no such shape"),
        ("sine:", None),
        ("sine:abc", "no duration"),
        ("sine:-1", "no duration"),
        ("sine:0", "no duration"),
        ("sine:nan", "no duration"),
        ("sine:inf", "no duration"),
        ("sine:5,,step:5", "no such shape"),
        ("positioner:10,sine:3", "closes the loop"),
        ("positioner:10,positioner:3", "closes the loop"),
    ],
)
def test_what_cannot_be_read_is_refused_in_words(text, words):
    if words is None:
        assert Excitation.parse(text).duration == 20.0
        return
    with pytest.raises(BadInput, match=words) as refused:
        Excitation.parse(text)
    assert refused.value.remedy
