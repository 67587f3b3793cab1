"""The largest mass that a recorded force can have moved: never below the true one, and near enough to be of use."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from seeded_valves import made, recorded

from benchmarks.plants.cases import Case, Valve
from benchmarks.plants.recordings import recordings
from identification import Outcome, experiment, fit, trace
from identification.data.largest_mass import largest_mass
from recordings import Recording
from simulator import random_valve


@pytest.mark.parametrize("noise", [1e-5, 1e-3])
@pytest.mark.parametrize("rate", [1000.0, 100.0, 20.0])
def test_it_is_above_the_mass_of_valves_that_stick_and_slip(rate, noise):
    for seed, course in zip(range(12), ("staircase:12", "multisine:12", "sine:12") * 4, strict=True):
        bound = largest_mass([experiment(recorded(seed, course, rate, noise))])
        assert bound > 5 * random_valve(seed)[0]["mass.m"]


def test_slips_bring_it_within_two_orders_of_magnitude():
    bounds = [largest_mass([experiment(recorded(seed, "staircase:12"))]) for seed in range(10)]
    assert np.median(np.array(bounds) / [random_valve(seed)[0]["mass.m"] for seed in range(10)]) < 100


def swinging(mass: float) -> Recording:
    """A mass on a spring without friction that rests for 1 s and is then shaken near its resonance."""
    t, spring = np.arange(0.0, 6.0, 1e-3), mass * (2 * np.pi * 5.0) ** 2
    force = np.where(t < 1.0, 0.0, 10.0 * np.sin(2 * np.pi * 4.8 * (t - 1.0)))

    def rates(now: float, state: np.ndarray) -> list[float]:
        return [state[1], (np.interp(now, t, force) - spring * state[0] - 2.0 * state[1]) / mass]

    x = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, max_step=2e-3).y[0]
    return made(t, force, x + np.random.default_rng(1).normal(0.0, 1e-6, len(t)))


def test_a_resonance_that_gathers_energy_from_the_force_does_not_pass_for_a_light_mass():
    assert largest_mass([experiment(swinging(20.0))]) > 20.0


def test_a_stop_that_the_stem_runs_against_does_not_pass_for_a_light_mass():
    """A mass of 5 kg, accelerated by 50 N, is stopped within a sample."""
    t = np.arange(0.0, 2.0, 2e-3)
    force = np.where(t < 1.0, 0.0, 50.0)
    x = np.minimum(np.where(t < 1.0, 0.0, 0.5 * (50.0 / 5.0) * (t - 1.0) ** 2), 0.02)
    bound = largest_mass([experiment(made(t, force, x + np.random.default_rng(2).normal(0.0, 1e-6, len(t))))])
    assert 5.0 < bound < 10.0


def test_one_wrong_sample_does_not_pass_for_a_light_mass():
    recording = recorded(3, "staircase:12")
    position = recording["position"].values.copy()
    position[4000] += 1e-3
    bound = largest_mass([experiment(made(recording.time, recording["force"].values, position))])
    assert bound > random_valve(3)[0]["mass.m"]


def test_what_never_rests_bounds_nothing():
    t = np.arange(0.0, 4.0, 2e-3)
    x = 0.01 * np.sin(2 * np.pi * t) + np.random.default_rng(4).normal(0.0, 1e-6, len(t))
    assert largest_mass([experiment(made(t, 100.0 * np.sin(2 * np.pi * t), x))]) == np.inf


def test_a_force_that_is_constant_bounds_nothing_and_is_what_a_fit_says_in_spite_of_constraints():
    t = np.arange(0.0, 4.0, 2e-3)
    x = 1e-3 * np.clip(t - 1.0, 0.0, 1.0) + np.random.default_rng(5).normal(0.0, 1e-6, len(t))
    experiments = [experiment(made(t, np.full(len(t), 50.0), x))]
    assert largest_mass(experiments) == np.inf
    assert fit(experiments, constraints=["mass.m<=5"]).outcome is Outcome.CONSTANT_INPUT


@pytest.mark.slow
def test_a_model_that_lacks_an_effect_does_not_end_at_a_mass_of_tonnes():
    """Friction that grows with the load: without the bound the base model ended at 1,800 kg, and nothing had a name."""
    case = Case(347706, ("load_dependent_friction",), 12.0)
    fitted, held_out, _ = recordings(case)
    found = trace(fitted, holdout=held_out)
    assert found.base.values["mass.m"] <= largest_mass([experiment(one) for one in fitted])
    assert found.effects_added == case.effects
    assert found.values["mass.m"] == pytest.approx(Valve.of(case.valve).values["mass.m"], rel=0.05)
