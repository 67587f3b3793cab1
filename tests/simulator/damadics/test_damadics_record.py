"""Scenarios as recordings: signals, noise, truth, events, and the same numbers however they are made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sample_effects import Drag
from scipy import stats

from recordings import read, read_truth, write
from simulator import CATALOGUE
from simulator.damadics import (
    CHANNELS,
    COLUMN,
    FORMS,
    INPUTS,
    SPANS,
    Actuator,
    Fault,
    Noise,
    measured,
    run,
    run_scenario,
    scenario,
    strengths,
)
from simulator.damadics.noise import normal

STROKE = 0.0381


def same(first, second):
    """Whether two recordings have the same samples."""
    return all(np.array_equal(first[name].values, second[name].values) for name in first)


@pytest.mark.parametrize("form", FORMS)
def test_a_recording_survives_its_file_with_truth_and_events(form, tmp_path):
    recording, truth = run_scenario("chapter5-f4", form, duration=75.0, sample=0.5)
    write(tmp_path / "rec.h5", recording, truth)
    found, truth = read(tmp_path / "rec.h5"), read_truth(tmp_path / "rec.h5")
    assert same(recording, found)
    assert [(event.time, event.kind) for event in found.events] == [(70.0, "fault")]
    assert "f4 friction" in found.events[0].text
    np.testing.assert_allclose(truth["f4"][-3:], [0.2, 0.225, 0.25])
    assert (truth["form"], truth["scenario"], truth["actuator.gain"]) == (form, "chapter5-f4", 100.0)
    assert ("lugre.fc" in truth) == (form == "lugre")
    assert found.plant.spring_preload_N == pytest.approx(60892 * 0.009525)
    assert (found.plant.moving_mass_kg, found.plant.stroke_m, found.plant.diaphragm_area_m2) == (2.0, STROKE, 0.029)


def test_signals_are_what_the_transmitters_send_in_si_units():
    recording, truth = run_scenario("healthy", duration=60.0)
    assert recording.time.tolist() == list(range(61))
    np.testing.assert_allclose(recording.si("position").values, STROKE * truth["position"], atol=1e-15)
    np.testing.assert_allclose(recording["pressure"].values, truth["pressure"], atol=1e-6)
    flow = np.minimum(truth["Fv"] + truth["Fv3"], 40.0)
    np.testing.assert_allclose(recording["mass_flow"].values, flow, rtol=1e-12)
    np.testing.assert_allclose(recording["flow"].values, 1000 * flow / truth["density"], rtol=1e-12)
    np.testing.assert_allclose(recording.si("setpoint").values, scenario("healthy").stimulus(recording.time)[:, 0])
    assert recording["mass_flow"].values.max() == 40.0  # the span is exceeded, and that is what is sent
    assert {name: recording[name].noise_std for name in recording} == dict.fromkeys(recording)


@pytest.mark.parametrize("form", FORMS)
def test_a_seed_repeats_and_another_differs(form):
    first, again, other = (run_scenario("f10-abrupt-small", form, True, seed, duration=30.0)[0] for seed in (5, 5, 6))
    assert same(first, again)
    assert not np.array_equal(first["position"].values, other["position"].values)


@pytest.mark.parametrize("form", FORMS)
def test_a_coarser_record_holds_the_same_samples(form):
    fine = run_scenario("healthy", form, True, 3, duration=110.0, sample=0.05)[0]
    coarse = run_scenario("healthy", form, True, 3, duration=110.0)[0]
    for name in coarse:
        np.testing.assert_array_equal(coarse[name].values, fine[name].values[::20])


def test_stepping_by_hand_gives_the_recording():
    what, noise, valve = scenario("chapter5-f11"), Noise(2), Actuator("lugre")
    steps = np.arange(30_000)
    rows = np.empty((len(steps), len(INPUTS)))
    rows[:, :5], rows[:, 5:] = what.stimulus(steps / 400), strengths(what.faults, steps / 400)
    rows[:, 0] = np.clip(rows[:, 0] + noise.setpoint(steps), 0.0, 1.0)
    state, parts = valve.start(), []
    for block in np.split(rows, 75):
        state, signals = valve.advance(state, block)
        parts.append(signals)
    shares = measured(np.concatenate(parts), noise, steps)
    recording, _ = run_scenario("chapter5-f11", "lugre", True, 2, duration=74.9975)
    np.testing.assert_array_equal(recording["position"].values, shares[:, CHANNELS.index("X")] * STROKE)


def test_noise_has_the_library_s_size_on_every_channel():
    quiet, _ = run_scenario("healthy", duration=900.0)
    noisy, _ = run_scenario("healthy", noise=True, seed=11, duration=900.0)
    for name, span in (("upstream_pressure", 4e6), ("downstream_pressure", 4e6), ("temperature", 200.0)):
        shares = (noisy[name].values - quiet[name].values) / span
        assert shares.std() == pytest.approx(1.414e-3, rel=0.08)
        assert abs(shares.mean()) < 5 * 1.414e-3 / 30
        assert noisy[name].noise_std == pytest.approx(1.414e-3 * span, rel=1e-3)
    np.testing.assert_array_equal(noisy["setpoint"].values, quiet["setpoint"].values)


def test_two_noisy_runs_differ_by_two_thousandths():
    first, second = (run_scenario("healthy", noise=True, seed=seed, duration=900.0)[0] for seed in (1, 2))
    shares = (first["upstream_pressure"].values - second["upstream_pressure"].values) / 4e6
    assert np.sqrt(np.mean(shares**2)) == pytest.approx(2.0e-3, abs=0.15e-3)


def test_the_hum_is_50_hertz_and_vanishes_at_one_sample_a_second():
    noise, steps = Noise(0, white=0.0), np.arange(4000)
    np.testing.assert_allclose(noise.setpoint(steps), 0.0025 * np.sin(2 * np.pi * 50 * steps / 400), atol=1e-12)
    assert not noise.setpoint(steps[::400]).any()
    assert Noise(0).deviation(1) == pytest.approx(np.hypot(2**0.5 * 1e-3, 0.0025 / 2**0.5))
    assert Noise(0).deviation(400) == pytest.approx(2**0.5 * 1e-3)


def test_noise_is_white_normal_and_the_same_in_any_order():
    steps = np.arange(100_000)
    z = normal(9, 4, steps)
    assert stats.kstest(z, "norm").pvalue > 0.01
    assert abs(np.corrcoef(z[1:], z[:-1])[0, 1]) < 0.012
    assert abs(np.corrcoef(z, normal(9, 5, steps))[0, 1]) < 0.012
    assert abs(np.corrcoef(z, normal(10, 4, steps))[0, 1]) < 0.012
    np.testing.assert_array_equal(normal(9, 4, steps[::-7]), z[::-7])


def test_transmitters_send_shares_of_their_spans_within_them():
    signals = np.zeros((1, len(COLUMN)))
    for name, value in (("CV", 0.5), ("P1", 5e6), ("P2", 1e6), ("T1", 50.0), ("X", -0.2), ("F", 10.0), ("CVI", -0.5)):
        signals[0, COLUMN[name]] = value
    assert dict(zip(CHANNELS, measured(signals)[0], strict=True)) == pytest.approx(
        {"CV": 0.5, "P1": 1.0, "P2": 0.25, "T1": 0.25, "X": 0.0, "F": 0.25, "CVI": 0.25, "Ps": 0.0, "Pz": 0.0}
    )
    assert tuple(SPANS) == CHANNELS


def test_a_fault_that_goes_leaves_two_events():
    what = replace(scenario("healthy"), faults=(Fault(19, 0.5, start_s=10.0, stop_s=20.0),))
    recording, _ = run(what, Actuator(), duration=30.0)
    assert [(event.time, event.kind) for event in recording.events] == [(10.0, "fault"), (20.0, "fault_end")]


def test_progress_is_reported_and_ends_with_all_steps():
    reports = []
    run_scenario("healthy", duration=160.0, progress=lambda *report: reports.append(report))
    assert {stage for stage, _, _ in reports} == {"simulation"}
    shares = [done / total for _, done, total in reports]
    assert shares == sorted(shares)
    assert len(shares) == 4
    assert shares[-1] == 1.0


def test_an_effect_of_ones_own_acts_in_a_scenario():
    own = {"catalogue": CATALOGUE.extended(Drag()), "duration": 5.0}
    without, braked = (
        run_scenario("chapter5-healthy", "lugre", effects={"sample_drag": {"c": c}}, **own)[0] for c in (0.0, 1e6)
    )
    assert not np.array_equal(without["position"].values, braked["position"].values)
