"""Simulated recordings: repeatable, with the truth beside them, and with the sensors that were asked for."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import BadInput, read, read_truth, write
from simulator import BASE, Excitation, Sensors, kernel, random_valve, simulate

SINE = Excitation.parse("sine:4")
VALUES, STROKE = random_valve(2)
PERFECT = Sensors()


def made(sensors: Sensors = PERFECT, seed: int = 0, **changes: float):
    return simulate(VALUES | changes, SINE, sensors, stroke=STROKE, seed=seed)


@pytest.fixture(scope="module")
def clean():
    return made()


def test_a_seed_repeats_it_and_another_one_does_not():
    noisy = Sensors(position_noise=1e-6)
    first, again, other = (made(noisy, seed)[0]["position"].values for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_without_noise_the_recording_is_the_truth(clean):
    recording, truth = clean
    assert np.array_equal(recording["position"].values, truth["position"])
    assert np.array_equal(recording["force"].values, truth["force"])
    assert truth["effects"] == "inertia spring lugre"
    assert {name: truth[name] for name in VALUES} == VALUES
    assert recording.source == "simulated"
    assert recording.plant.stroke_m == STROKE
    assert recording["force"].role == "input"
    assert recording["position"].role == "output"


def test_it_is_the_kernel_that_moves(clean):
    recording, truth = clean
    valve = kernel(BASE)
    rest = (truth["force"][0] - VALUES["spring.F0"]) / VALUES["spring.K"]
    fine = valve.run(recording.time, truth["force"], valve.vector(VALUES), valve.start(rest), h_max=1e-5)
    assert np.max(np.abs(fine.outputs[:, 0] - truth["position"])) < 1e-4 * STROKE


@pytest.mark.parametrize("rate", [20.0, 333.0, 1000.0])
def test_the_rate_is_as_asked(rate):
    recording, _ = made(Sensors(rate=rate))
    assert len(recording) == round(4 * rate) + 1
    assert np.allclose(np.diff(recording.time), 1 / rate)


def test_noise_is_as_large_as_asked_and_said_to_be(clean):
    recording, truth = made(Sensors(position_noise=2e-6, force_noise=0.7), seed=5)
    for name, size in (("position", 2e-6), ("force", 0.7)):
        error = recording[name].values - truth[name]
        assert np.std(error) == pytest.approx(size, rel=0.05)
        assert abs(np.mean(error)) < 0.1 * size
        assert recording[name].noise_std == size
    assert np.array_equal(made(seed=5)[1]["position"], truth["position"])
    assert clean[0]["position"].noise_std is None


def test_quantisation_is_as_coarse_as_asked_and_said_to_be():
    recording, truth = made(Sensors(position_step=1e-5, force_step=2.0))
    for name, step in (("position", 1e-5), ("force", 2.0)):
        steps = recording[name].values / step
        assert np.allclose(steps, np.round(steps), atol=1e-6)
        assert np.max(np.abs(recording[name].values - truth[name])) <= 0.5 * step * (1 + 1e-9)
        assert recording[name].resolution == step


def test_a_file_keeps_recording_and_truth_apart(tmp_path, clean):
    recording, truth = clean
    write(tmp_path / "rec.h5", recording, truth)
    again = read(tmp_path / "rec.h5")
    assert set(again) == {"time", "force", "position"}
    assert np.array_equal(again["position"].values, recording["position"].values)
    stored = read_truth(tmp_path / "rec.h5")
    assert stored["lugre.fc"] == VALUES["lugre.fc"]
    assert np.array_equal(stored["position"], truth["position"])


@pytest.mark.parametrize("seed", range(0, 200, 7))
def test_random_valves_are_plausible(seed):
    values, stroke = random_valve(seed)
    assert random_valve(seed) == (values, stroke)
    assert 2 <= values["mass.m"] <= 5
    assert 1e4 <= values["spring.K"] <= 1e5
    assert 0.02 <= stroke <= 0.04
    assert 50 <= values["lugre.fc"] < values["lugre.fs"] <= 480
    assert 1e5 <= values["lugre.sigma0"] <= 1e7
    assert values["lugre.sigma1"] > 0
    assert values["lugre.sigma2"] > 0


def test_a_plant_without_a_spring_is_simulated_too():
    recording, _ = made(**{"spring.K": 0.0, "spring.F0": 0.0})
    assert np.isfinite(recording["position"].values).all()
    assert np.ptp(recording["position"].values) > 0


@pytest.mark.parametrize(
    ("sensors", "words"),
    [
        ({"rate": 0.0}, "rate 0"),
        ({"rate": -5.0}, "rate -5"),
        ({"rate": float("inf")}, "rate inf"),
        ({"position_noise": -1.0}, "position noise -1"),
        ({"force_noise": float("nan")}, "force noise nan"),
        ({"position_step": -1e-6}, "position step"),
        ({"force_step": float("inf")}, "force step"),
    ],
)
def test_sensors_that_cannot_be_are_refused(sensors, words):
    with pytest.raises(BadInput, match=words):
        Sensors(**sensors)


@pytest.mark.parametrize("changes", [{"lugre.fc": -5.0}, {"mass.m": -1.0}, {"spring.K": float("nan")}])
def test_valves_that_cannot_be_are_refused(changes):
    with pytest.raises(BadInput, match=next(iter(changes))):
        made(**changes)


def test_more_samples_than_memory_has_are_refused():
    with pytest.raises(BadInput, match="samples"):
        made(Sensors(rate=1e9))


def test_a_missing_parameter_is_named():
    with pytest.raises(KeyError, match=r"lugre\.vs"):
        simulate({k: v for k, v in VALUES.items() if k != "lugre.vs"}, SINE, Sensors(), stroke=STROKE)
