"""First guesses: what an effect reads off recordings at a first look is of the size of what was there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
import traced_valves

from identification import experiment
from identification.data.grid import grids
from identification.tracing.models.guesses import looks
from recordings import Recording
from simulator import BASE, CATALOGUE, FirstLook, random_valve, rhythms

VALVE, STROKE = random_valve(traced_valves.SEED)
K = VALVE["spring.K"]

THERE: Mapping[str, Mapping[str, float]] = {
    "asymmetric_coulomb": {"a": 0.2}, "asymmetric_viscous": {"b": 300.0},
    "position_dependent_friction": {"a": 0.6, "x0": 0.4 * STROKE, "w": 0.1 * STROKE, "b": 0.0},
    "position_speed_friction": {"a1": 0.5, "a2": 0.2, "a3": 0.5, "x0": 0.5 * STROKE, "w": 0.15 * STROKE, "u": 0.05},
    "load_dependent_friction": {"c": 1e-3}, "dwell_stiction": {"a": 0.5, "gamma": 1.0, "d": 5e-4},
    "nonlocal_presliding": {"f": 60.0, "d": 4e-4}, "friction_drift": {"r": 0.02}, "quadratic_drag": {"c": 2e4},
    "hardening_spring": {"k3": K / STROKE**2}, "contact_stiffness": {"k": 0.5 * K, "x0": 0.6 * STROKE},
    "flow_force": {"f": 80.0, "x0": 0.4 * STROKE, "w": 0.15 * STROKE},
    "periodic_force": {"a": 20.0, "b": 20.0, "f": 3.1},
    "position_periodic_force": {"a": 20.0, "b": 10.0, "pitch": 0.15 * STROKE}, "force_offset_drift": {"r": 5.0},
    "dead_time": {"tau": 0.02}, "force_gain": {"g": 0.1}, "actuator_hysteresis": {"h": 60.0, "r": 200.0},
    "actuator_lag": {"tau": 0.03}, "backlash": {"width": 0.02 * STROKE}, "sensor_lag": {"tau": 0.03},
    "sensor_nonlinearity": {"q": 0.03, "c": 0.01, "L": STROKE}, "sensor_drift": {"r": 2e-4},
}  # fmt: skip
"""Effects of a size that shows, by symbol: play of 2 % of the stroke, a cubic spring as strong as the linear one."""
HELD = {"asymmetric_coulomb": {"spring.F0"}, "force_gain": {"mass.m", "spring.K", "spring.F0"}}
"""What has to be known of the valve for an effect to be told from the base at all."""
NOT_SEEN = {"frictional_memory", "stribeck_exponent"}
"""Effects whose guess is no better than their scale: they act at speeds of which a first look sees too little."""
WITHIN = {"backlash": 4.0, "dwell_stiction": 4.0, "nonlocal_presliding": 4.0, "actuator_hysteresis": 4.0}
"""Factors by which guesses may be off, 2 for others: what acts after reversals hides behind bristles."""


def looks_at(
    recordings: Sequence[Recording], base: Mapping[str, float], held: Iterable[str] = ()
) -> list[FirstLook]:  # fmt: skip
    """What is seen in recordings beside a base, of which some parameters are known."""
    return [
        FirstLook.of(grid.t, grid.motion, grid.force.u, base, held)
        for grid in grids([experiment(r) for r in recordings])
    ]


def guessed(effect: str) -> dict[str, float]:
    """The likeliest guess from two recordings, by symbol, beside the base as a fit without the effect has it."""
    there = THERE[effect]
    recordings = traced_valves.recorded(effect, {f"{effect}.{name}": value for name, value in there.items()})[:2]
    base = dict(VALVE)
    for name in ("lugre.fc", "lugre.fs"):  # half of a play, times K, looks like friction
        base[name] += K * there.get("width", 0.0) / 2
    [first, *_] = CATALOGUE[effect].first_guess(looks_at(recordings, base, HELD.get(effect, ())), base)
    return {name.removeprefix(f"{effect}."): value for name, value in first.items()}


def test_every_effect_is_there():
    assert {*THERE, *NOT_SEEN, *BASE} == {*CATALOGUE.ids}


@pytest.mark.parametrize("effect", THERE)
def test_a_guess_is_of_the_size_of_what_is_there(effect: str):
    found, there, factor = guessed(effect), THERE[effect], WITHIN.get(effect, 2.0)
    if "x0" in there:
        assert abs(found["x0"] - there["x0"]) < 0.05 * STROKE
    for name in {"f", "pitch"} & set(there) if "b" in there else ():
        assert found[name] == pytest.approx(there[name], rel=0.05)
    strongest = max(
        (p for p in CATALOGUE[effect].parameters if p.neutral == 0), key=lambda p: there[p.symbol] / p.scale
    )
    if {"a", "b"} <= set(there) and effect.endswith("periodic_force"):
        sizes = np.hypot(found["a"], found["b"]), np.hypot(there["a"], there["b"])
    else:
        sizes = found[strongest.symbol], there[strongest.symbol]
    assert 1 / factor < sizes[0] / sizes[1] < factor


def test_a_guess_of_a_strong_cubic_spring_has_the_straight_spring_beside_it():
    found = guessed("hardening_spring")
    assert found["spring.K"] == pytest.approx(K, rel=0.1)
    assert found["k3"] == pytest.approx(K / STROKE**2, rel=0.1)


@pytest.mark.parametrize("effect", ["actuator_lag", "dead_time", "sensor_lag"])
def test_a_lag_of_which_samples_tell_little_is_guessed_by_the_viscous_friction_that_it_makes(effect: str):
    tau, own = 0.1, 0.03 * K  # a valve whose own viscous friction is a quarter of what a model has
    base = VALVE | {"lugre.sigma2": own + tau * K, "mass.m": VALVE["mass.m"] + tau * own}
    recordings = traced_valves.recorded("sensor_lag", {"sensor_lag.tau": tau})[:2]
    _, guess = CATALOGUE[effect].first_guess(looks_at(recordings, base), base)
    assert guess[f"{effect}.tau"] == pytest.approx(tau, rel=0.3)
    assert guess["lugre.sigma2"] == pytest.approx(own, rel=0.5)
    assert guess["mass.m"] < base["mass.m"]


@pytest.mark.parametrize("f", [0.04, 0.31, 2.9, 3.52, 11.07])
def test_a_rhythm_shows_in_pulls_of_which_only_slips_tell(f: float):
    rng, pulls, times = np.random.default_rng(3), [], []
    for seconds, first in ((40.0, 0.0), (50.0, 3.0)):
        t = first + np.arange(0.0, seconds, 2e-3)
        slips = (t / 0.16 + 0.3 * np.sin(t)) % 1 < 0.2  # about six in a second: a second rhythm six hertz away
        times.append(t)
        pulls.append(np.where(slips, np.sin(2 * np.pi * f * t + 1.0) + 3.0 * rng.normal(size=len(t)), 0.0))
    assert rhythms(times, pulls, 0.03, 40.0)[0] == pytest.approx(f, abs=0.25 / 50.0)


def test_no_rhythm_is_where_nothing_moves_or_little_was_recorded():
    still, short = [np.zeros(50)], [np.linspace(0.0, 0.02, 20)]
    assert rhythms(still, [np.ones(50)], 1.0, 40.0) == []
    assert rhythms(short, [np.ones(20)], 75.0, 40.0) == []


@pytest.mark.slow
def test_the_measurements_pull_at_the_stem_in_the_rhythm_of_a_force():
    model = traced_valves.traced("periodic_force", a=4.0, b=4.0, f=3.1).selection.base
    bare = [replace(look, pull=np.zeros(len(look.t))) for look in looks(model)]

    def nearest(some):
        found = [guess["periodic_force.f"] for guess in CATALOGUE["periodic_force"].first_guess(some, model.values)]
        return min(abs(f - 3.1) for f in found[:2])

    assert nearest(looks(model)) < 0.02
    assert nearest(bare) > 0.02


@pytest.mark.slow
def test_a_play_of_a_fiftieth_of_the_stroke_is_named_with_its_width():
    found = traced_valves.traced("backlash", width=0.02 * STROKE)
    assert found.verdict == "backlash"
    assert found.values["backlash.width"] == pytest.approx(0.02 * STROKE, rel=0.1)


@pytest.mark.slow
def test_a_strong_cubic_spring_is_named_with_its_stiffness():
    found = traced_valves.traced("hardening_spring", k3=K / STROKE**2)
    assert found.verdict == "hardening_spring"
    assert found.values["hardening_spring.k3"] == pytest.approx(K / STROKE**2, rel=0.05)
