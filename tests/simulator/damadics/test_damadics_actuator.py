"""The stepping interface and the physics of both friction forms."""

from __future__ import annotations

import copy
import functools
from dataclasses import replace

import numpy as np
import pytest
from sample_effects import SAMPLES

from recordings import BadInput
from simulator import CATALOGUE
from simulator.damadics import (
    COLUMN,
    FORMS,
    INPUTS,
    STEP,
    Actuator,
    Fault,
    Parameters,
    run,
    scenario,
    stimuli,
    strengths,
)

P = Parameters()


def inputs(n, cv=0.5, faults=(), first=0):
    """Rows for n steps: the set point moves up and down by 0.2, everything else stands."""
    t = np.arange(first, first + n) * STEP
    rows = np.zeros((n, len(INPUTS)))
    rows[:, :5] = stimuli.constant(cv)(t)
    rows[:, 0] += 0.2 * np.sign(np.sin(2 * np.pi * t / 6.0))
    rows[:, 5:] = strengths(faults, t)
    return rows


def column(signals, name):
    return signals[:, COLUMN[name]]


@functools.cache
def slow_sine(form, fc=None, fs=None):
    """Signals at every step over 60 s of a slow sine of the set point at constant pressures, after 20 s to settle."""
    friction = {} if fc is None else {"lugre": {"fc": fc, "fs": fs}}

    def stimulus(t):
        columns = stimuli.constant(0.5)(t)
        columns[:, 0] += 0.25 * np.sin(2 * np.pi * t / 40.0)
        return columns

    what = replace(scenario("healthy"), stimulus=stimulus)
    _, truth = run(what, Actuator(form, effects=friction), duration=80.0, sample=STEP)
    return {name: values[8000:] for name, values in truth.items() if np.ndim(values)}


@pytest.mark.parametrize("form", FORMS)
def test_blocks_of_any_size_give_one_run_bit_for_bit(form):
    valve = Actuator(form)
    rows = inputs(4000, faults=(Fault(4, 0.1, start_s=2.0, development_s=3.0), Fault(15, 0.1, start_s=4.0)))
    end, whole = valve.advance(valve.start(), rows)
    rng, state, parts = np.random.default_rng(3), valve.start(), []
    while state.step < len(rows):
        n = int(rng.integers(1, 120))
        state, signals = valve.advance(state, rows[state.step : state.step + n])
        parts.append(signals)
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    np.testing.assert_array_equal(state.values, end.values)
    assert state.step == end.step == 4000
    assert state.time == 10.0


@pytest.mark.parametrize("form", FORMS)
def test_a_state_can_be_gone_on_from_twice(form):
    valve = Actuator(form)
    state, _ = valve.advance(valve.start(0.3), inputs(1000))
    first, second = (valve.advance(state, inputs(500, first=1000))[1] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert not state.values.flags.writeable


@pytest.mark.parametrize("form", FORMS)
def test_observing_shows_the_next_signals_and_moves_nothing(form):
    valve = Actuator(form)
    state, _ = valve.advance(valve.start(), inputs(900))
    seen = valve.observe(state, inputs(1, first=900)[0])
    np.testing.assert_array_equal(seen, valve.advance(state, inputs(5, first=900))[1][0])


@pytest.mark.parametrize("form", FORMS)
def test_an_actuator_starts_where_it_is_told(form):
    valve = Actuator(form)
    signals = valve.observe(valve.start(0.4), inputs(1)[0])
    assert signals[COLUMN["X"]] == pytest.approx(0.4)
    assert signals[COLUMN["Ps"]] == pytest.approx(0.0, abs=1e-6)


def test_the_positioner_samples_exactly_every_14_steps():
    valve = Actuator()
    cvi = column(valve.advance(valve.start(), inputs(40_000))[1], "CVI")
    changes = np.flatnonzero(np.diff(cvi)) + 1
    assert len(changes) > 500
    assert set(changes % 14) == {0}


@pytest.mark.parametrize("form", FORMS)
def test_forces_balance_at_every_sample(form):
    s = slow_sine(form)
    spring_travel = s["x"] if form == "lugre" else s["position"] * P.stroke
    inertia = P.mass * np.gradient(s["v"], STEP)
    load = P.spring_rate * spring_travel + P.preload + s["friction"] + s["Fvc"] - P.mass * P.gravity
    gap = inertia + load - P.diaphragm_area * s["pressure"]
    # The published spring is a step late, which is 30 N/mm/s x 2.5 ms of it.
    assert np.sqrt(np.mean(gap**2)) < 0.5
    assert np.ptp(P.diaphragm_area * s["pressure"]) > 2000.0


def test_friction_stays_between_its_levels_and_reaches_them():
    friction = slow_sine("lugre")["friction"]
    assert 150.0 < friction.max() < 175.0
    assert -175.0 < friction.min() < -150.0


def test_with_matched_friction_both_forms_move_alike():
    play = slow_sine("play")["position"]
    matched, default = (
        np.sqrt(np.mean((play - force["position"]) ** 2))
        for force in (slow_sine("lugre", 11.6, 11.6), slow_sine("lugre"))
    )
    # 11.6 N is the force equivalent of a play of 1 % of the stroke; the default friction is ten times that.
    assert matched < 1e-3
    assert default > 3 * matched


def test_stick_slip_comes_with_a_steep_stribeck_curve_only():
    def ramp(t):
        columns = stimuli.constant(0.3)(t)
        columns[:, 0] += 1e-3 * np.maximum(t - 20.0, 0.0)
        return columns

    def slips(**friction):
        what = replace(scenario("healthy"), stimulus=ramp)
        _, truth = run(what, Actuator("lugre", effects={"lugre": friction}), duration=220.0, sample=STEP)
        speed = truth["v"][16_000:]
        return np.sum(np.diff((speed > 5e-3).astype(int)) == 1), speed.max()

    assert slips()[0] == 0
    jumps, fastest = slips(fs=232.0, vs=2e-4)
    assert 6 <= jumps <= 14
    assert 0.02 < fastest < 0.1


@pytest.mark.parametrize("number", range(1, 20))
def test_every_fault_at_full_strength_leaves_the_force_form_finite_and_within_its_stops(number):
    valve = Actuator("lugre")
    rows = inputs(8000, faults=(Fault(number, start_s=8.0),))
    signals = valve.advance(valve.start(), rows)[1]
    position = column(signals, "position")
    top = 1.1 if number == 3 else 1.0
    assert np.isfinite(signals).all()
    assert position.min() >= -1e-12
    assert position.max() <= top + 1e-12
    assert not np.array_equal(signals[3300:], valve.advance(valve.start(), inputs(8000))[1][3300:])


def test_more_friction_widens_the_hysteresis_of_the_force_form():
    def width(strength):
        valve = Actuator("lugre")
        rows = inputs(12_000, faults=(Fault(4, abs(strength), direction=1 if strength >= 0 else -1),))
        return np.ptp(column(valve.advance(valve.start(), rows)[1], "friction")[4000:])

    assert width(-0.9) < width(0.0) < width(0.2)
    # 1160 N x 0.2 is added to either side of 116 N.
    assert width(0.2) > 2 * (116.0 + 0.2 * P.spring_rate * P.stroke / 2)


@pytest.mark.parametrize(("number", "signal"), [(14, "Ps"), (19, "F")])
def test_the_sense_of_sensor_faults_follows_library_or_text(number, signal):
    rows = inputs(4000, faults=(Fault(number, 0.5, start_s=8.0),))
    after = slice(3300, None)
    healthy = column(Actuator().advance(Actuator().start(), inputs(4000))[1], signal)[after]
    library, text = (
        column(valve.advance(valve.start(), rows)[1], signal)[after] for valve in (Actuator(), Actuator(doc_sign=True))
    )
    np.testing.assert_allclose(library, 1.5 * healthy, rtol=1e-12)
    np.testing.assert_allclose(text, 0.5 * healthy, rtol=1e-12)


def test_the_transducer_fault_speeds_up_in_the_library_s_sense_and_slows_down_in_the_text_s():
    rows = inputs(600, cv=0.5, faults=(Fault(12, 0.75),))
    pressures = {
        name: column(valve.advance(valve.start(), row)[1], "Ps")[-1]
        for name, valve, row in (
            ("healthy", Actuator(), inputs(600)),
            ("library", Actuator(), rows),
            ("text", Actuator(doc_sign=True), rows),
        )
    }
    # The relay is fully open while the chamber fills, so it can only lose.
    assert pressures["text"] < 0.5 * pressures["healthy"]
    assert pressures["library"] == pytest.approx(pressures["healthy"], rel=0.02)


@pytest.mark.parametrize("effect", SAMPLES, ids=lambda effect: effect.id)
def test_any_effect_can_be_undeclared(effect):
    """Whatever it acts on, it changes what is measured, and with its neutral values it changes nothing."""
    catalogue = CATALOGUE.extended(effect)
    neutral = {p.symbol: p.neutral for p in effect.parameters if p.neutral is not None}
    rows = inputs(6000)
    plain, absent, present = (
        column(valve.advance(valve.start(), rows)[1], "X")
        for valve in (
            Actuator("lugre"),
            Actuator("lugre", effects={effect.id: neutral}, catalogue=catalogue),
            Actuator("lugre", effects={effect.id: {}}, catalogue=catalogue),
        )
    )
    np.testing.assert_allclose(absent, plain, atol=2e-6)
    assert np.abs(present - plain).max() > 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_a_copy_of_a_used_actuator_gives_the_same_numbers(form):
    valve = Actuator(form, Parameters(gain=40.0), doc_sign=True)
    first = valve.advance(valve.start(), inputs(800))[1]
    copied = copy.deepcopy(valve)
    np.testing.assert_array_equal(copied.advance(copied.start(), inputs(800))[1], first)


def test_friction_and_actuator_values_are_there_by_their_full_names():
    valve = Actuator("lugre", Parameters(spring_rate=50e3), {"lugre": {"fc": 200.0}})
    assert valve.values["lugre.fc"] == 200.0
    assert valve.values["lugre.fs"] == 160.0
    assert valve.values["spring.K"] == 50e3
    assert valve.values["spring.F0"] == pytest.approx(50e3 * 0.009525)
    assert Actuator().values == {}


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Actuator("lugre", effects={"backlsh": {}}), r"there is no effect 'backlsh'; "),
        (lambda: Actuator("lugre", effects={"lugre": {"fx": 1.0}}), r"effect lugre: it has no parameter 'fx'"),
        (lambda: Actuator("lugre", effects={"lugre": {"fc": -1.0}}), r"fc is -1 N; it is a number from 0 to inf"),
        (lambda: Actuator("lugre", effects={"lugre": {"fc": np.nan}}), r"fc is nan N"),
        (
            lambda: Actuator(effects={"lugre": {}}),
            r"'lugre' is asked for with the form 'play'; .* need the form 'lugre'",
        ),
        (lambda: Actuator("play").start(1.2), r"the start position is 1.2; it is a share of the stroke"),
        (lambda: Actuator().advance(Actuator().start(), np.zeros((3, 5))), r"their shape is \(3, 5\)"),
        (lambda: Actuator().advance(Actuator().start(), np.zeros((0, 24))), r"their shape is \(0, 24\)"),
        (lambda: Actuator().advance(Actuator().start(), np.full((2, 24), np.nan)), r"CV of step 0 is nan"),
        (lambda: Actuator().advance(Actuator("lugre").start(), inputs(1)), r"go on with an actuator of the same form"),
    ],
)
def test_what_cannot_be_is_refused_in_words(build, words):
    with pytest.raises(BadInput, match=words):
        build()


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
def test_without_a_compiler_the_numbers_are_the_same(form, monkeypatch):
    def signals():
        valve = Actuator(form)
        return valve.advance(valve.start(), inputs(8000, faults=(Fault(10, start_s=10.0),)))[1]

    compiled = signals()
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    np.testing.assert_array_equal(signals(), compiled)


def test_faults_beyond_their_range_are_limited():
    rows = inputs(400)
    rows[:, 4 + 1], beyond = 1.0, inputs(400)
    beyond[:, 4 + 1] = 3.0
    valve = Actuator()
    np.testing.assert_array_equal(valve.advance(valve.start(), rows)[1], valve.advance(valve.start(), beyond)[1])
