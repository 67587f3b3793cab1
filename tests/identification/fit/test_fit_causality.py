"""Two causalities, and plants without a spring: what drives and what answers decides how a recording is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from seeded_valves import made, moved, recorded, scores

from identification import Outcome, experiment, fit, identify, uncertainty_of
from recordings import Plant, Recording, Signal
from simulator import BASE, kernel, random_valve

SEED = 3
TRUTH, STROKE = random_valve(SEED)
FORCE_NOISE = 0.5


def imposed(
    values: dict[str, float], position_noise: float, *, roles: tuple[str, str] = ("input", "output"), seed: int = 11
):
    """A rig moves the stem through slow sines, some tenths of a hertz, and measures the force; 30 s at 500 Hz."""
    t = np.arange(15000) / 500.0
    omega, size = 2 * np.pi * np.array([0.1, 0.23, 1.1]), 0.01 * np.array([1.0, 0.3, 0.03])
    phase = np.outer(t, omega)
    x, v, a = 0.015 + np.sin(phase) @ size, np.cos(phase) @ (size * omega), -np.sin(phase) @ (size * omega**2)
    rig = kernel(BASE, "motion")
    motion = np.column_stack([x, v, a, np.zeros_like(t)])
    force = rig.run(t, motion, rig.vector(values), rig.start()).outputs[:, 0]
    rng = np.random.default_rng(seed)
    signals = [
        Signal("time", t, "s", "time"),
        Signal("position", x + rng.normal(0.0, position_noise, len(t)), "m", roles[0]),
        Signal("force", force + rng.normal(0.0, FORCE_NOISE, len(t)), "N", roles[1]),
    ]
    return Recording.of(signals, plant=Plant(stroke_m=STROKE), title="rig")


def test_the_roles_say_that_the_rig_imposes_the_motion():
    prepared = experiment(imposed(TRUTH, 0.0))
    found = fit([prepared])
    known = uncertainty_of(found)
    assert prepared.causality == "motion"
    assert found.kernel.causality == "motion"
    assert found.outcome is Outcome.CONVERGED
    assert found.rms == pytest.approx(1.0, abs=0.05)
    assert max(abs(z) for z in scores(found, known, TRUTH).values()) < 4.5


def test_noise_on_an_imposed_position_leaves_spring_and_friction_levels():
    """Errors of the motion are no errors of the force: they bias what lives in the first micrometres, not the rest."""
    found = identify([imposed(TRUTH, 1e-6)])
    assert found.fit.outcome is Outcome.CONVERGED
    for name, share in (("spring.K", 2e-3), ("spring.F0", 2e-3), ("lugre.fc", 5e-3), ("lugre.fs", 0.05)):
        assert found.fit.values[name] == pytest.approx(TRUTH[name], rel=share)
    assert found.crosscheck is not None
    assert found.crosscheck.agrees


def test_an_option_goes_before_the_roles():
    recording = imposed(TRUTH, 0.0, roles=("output", "input"))
    assert experiment(recording).causality == "force"
    assert experiment(recording, "motion").causality == "motion"
    overridden = identify([recording], causality="motion", check=False)
    plain = identify([imposed(TRUTH, 0.0)], check=False)
    assert overridden.fit.values == plain.fit.values


def test_a_motion_driven_model_states_its_error_as_a_force():
    found = identify([imposed(TRUTH, 0.0)], holdout=[imposed(TRUTH, 0.0, seed=12)], check=False)
    assert found.model.quality["causality"] == "motion"
    for kind in ("fit", "holdout"):
        assert found.model.error[kind]["rmse_N"] == pytest.approx(FORCE_NOISE, rel=0.05)
    assert {run.unit for run in found.trajectories + found.holdout} == {"N"}
    (later,) = found.on([imposed(TRUTH, 0.0, seed=12)])
    np.testing.assert_allclose(later.simulated, found.holdout[0].simulated, atol=1e-9)


def test_a_rig_without_a_spring_gives_the_friction():
    values = TRUTH | {"spring.K": 0.0}
    found = identify([imposed(values, 0.0)], given={"spring.K": 0.0})
    assert found.fit.outcome is Outcome.CONVERGED
    assert found.model.parameters["spring.K"].status == "given"
    assert found.fit.values["lugre.fc"] == pytest.approx(TRUTH["lugre.fc"], rel=2e-3)
    assert found.fit.values["spring.F0"] == pytest.approx(TRUTH["spring.F0"], rel=2e-3)
    assert found.crosscheck is not None
    assert found.crosscheck.agrees


@pytest.fixture(scope="module")
def drive() -> Recording:
    """A drive without spring, pushed to and fro, with jerks: it travels some metres in 20 s."""
    t = np.arange(10000) / 500.0
    push = np.sign(np.sin(2 * np.pi * 0.5 * t)) * (0.75 + 0.5 * np.sin(2 * np.pi * 0.13 * t))
    force = 1.4 * TRUTH["lugre.fs"] * push + 30.0 * np.sin(2 * np.pi * 3.1 * t)
    position = moved(TRUTH | {"spring.K": 0.0, "spring.F0": 0.0}, t, force)
    noise = np.random.default_rng(5).normal(0.0, 2e-6, len(t))
    return made(t, force, position + noise)


@pytest.mark.slow
def test_a_drive_without_a_spring_is_fitted_from_its_force(drive):
    """An integrator is fitted in windows of 10 ms, which say little of what lives in milliseconds: mass, bristles."""
    found = identify([drive], given={"spring.K": 0.0})
    assert found.fit.outcome is Outcome.CONVERGED
    for name, share in (("lugre.fc", 0.01), ("lugre.sigma2", 0.01), ("mass.m", 0.1), ("lugre.sigma0", 0.1)):
        assert found.fit.values[name] == pytest.approx(TRUTH[name], rel=share)
    assert abs(found.fit.values["spring.F0"]) < 0.5
    assert found.model.parameters["spring.K"].status == "given"
    assert found.crosscheck is None or found.crosscheck.agrees


def test_gaps_and_missing_forces_of_a_rig_are_passed_over():
    recording = imposed(TRUTH, 0.0)
    force = recording["force"].values.copy()
    force[3000:3300] = np.nan
    position = recording["position"].values.copy()
    position[8000:8050] = np.nan
    signals = [
        recording["time"],
        replace(recording["force"], values=force),
        replace(recording["position"], values=position),
    ]
    prepared = experiment(Recording.of(signals))
    assert [len(s.t) for s in prepared.segments] == [8000, 6950]
    assert sum(s.seen.sum() for s in prepared.segments) == 14650
    found = fit([prepared])
    assert found.outcome is Outcome.CONVERGED
    assert max(abs(z) for z in scores(found, uncertainty_of(found), TRUTH).values()) < 4.5


def test_a_force_driven_recording_can_be_read_as_a_rig_too():
    """The same valve, both ways: spring and Coulomb friction are the same."""
    recording = recorded(SEED, "sine:16,presliding:4")
    one, other = (fit([experiment(recording, causality)]).values for causality in ("force", "motion"))
    assert one["spring.K"] == pytest.approx(other["spring.K"], rel=0.01)
    assert one["lugre.fc"] == pytest.approx(other["lugre.fc"], rel=0.02)
