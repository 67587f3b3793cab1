"""What the parameters of effects mean: each number can be read off a motion or a force that shows it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from simulator import BASE, CATALOGUE, Quantities, kernel

TYPICAL = {e.parameter_name(p.symbol): p.scale for e in CATALOGUE.effects for p in e.parameters}
FC = {"lugre.fc": 150.0, "lugre.fs": 150.0, "lugre.sigma2": 0.0, "lugre.sigma1": 0.0}


def pushed(effects, v, t, u=0.0, x0=0.0, **changes):
    """Force [N] of effects under a velocity v(t), imposed at samples t."""
    a, x = np.gradient(v, t), x0 + np.concatenate([[0], np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(t))])
    k = kernel(effects, "motion")
    p = k.vector(TYPICAL | {name.replace("__", "."): value for name, value in changes.items()})
    return x, k.run(t, np.column_stack([x, v, a, u + 0 * t]), p, k.start(x0)).outputs[:, 0]


def sliding(effect, way=1.0, t=2.0, u=0.0, x0=0.0, **changes):
    """Friction at the end of a slide of 20 mm at 20 mm/s, times and places counted from the end."""
    times = np.linspace(t - 1.0, t, 2001)
    moving = np.full(2001, 0.02 * way)
    _, force = pushed(
        (effect, "lugre"),
        moving,
        times,
        u,
        x0 - 0.02 * way,
        **{k.replace(".", "__"): v for k, v in FC.items()},
        **changes,
    )
    return force[-1]


def test_levels_differ_by_direction_by_the_given_share():
    up, down = (sliding("asymmetric_coulomb", way, asymmetric_coulomb__a=0.2) for way in (1, -1))
    assert (up, down) == (pytest.approx(180.0), pytest.approx(-120.0))
    up, down = (sliding("asymmetric_viscous", way, asymmetric_viscous__b=500.0) for way in (1, -1))
    assert (up, down) == (pytest.approx(160.0), pytest.approx(-140.0))


@pytest.mark.parametrize(("place", "level"), [(0.012, 1.5), (0.016, 1 + 0.5 / np.e), (0.1, 1.0)])
def test_friction_rises_at_a_place_and_along_the_stroke(place, level):
    at = {"position_dependent_friction__a": 0.5, "position_dependent_friction__w": 0.004}
    flat = sliding("position_dependent_friction", x0=place, position_dependent_friction__b=0.0, **at)
    tilted = sliding("position_dependent_friction", x0=place, position_dependent_friction__b=2.0, **at)
    assert flat == pytest.approx(150 * level, rel=0.02)
    assert tilted - flat == pytest.approx(150 * 2.0 * place, rel=0.05)


@pytest.mark.parametrize(("place", "rise"), [(0.010, 0.3), (0.016, -0.2), (0.022, 0.5)])
@pytest.mark.parametrize("speeds", [0.01, 1.0])
def test_friction_rises_in_several_bells_and_less_at_speed_as_in_equation_2_25(place, rise, speeds):
    given = {"a1": 0.3, "a2": -0.2, "a3": 0.5, "x0": 0.016, "w": 0.004, "u": 0.02 / speeds}
    level = sliding(
        "position_speed_friction", x0=place, **{f"position_speed_friction__{n}": v for n, v in given.items()}
    )
    neighbours = 0.8 if place == 0.016 else -0.2
    rise += neighbours * np.exp(-(1.5**2))
    assert level == pytest.approx(150 * (1 + rise * np.exp(-(speeds**2))), rel=0.02)


def test_friction_grows_with_the_load_and_with_time():
    assert sliding("load_dependent_friction", u=400.0, load_dependent_friction__c=1e-3) == pytest.approx(210.0)
    assert sliding("load_dependent_friction", u=-400.0, load_dependent_friction__c=1e-3) == pytest.approx(210.0)
    assert sliding("friction_drift", t=100.0, friction_drift__r=2e-3) == pytest.approx(180.0, rel=1e-3)


@pytest.mark.parametrize(("rest", "rise"), [(1.0, 0.632), (3.0, 0.95), (99.0, 1.0)])
def test_break_away_rises_with_time_at_rest_as_in_equation_2_6(rest, rise):
    t = np.concatenate([np.linspace(0, rest, 1001), rest + 1e-5 * np.arange(1, 4001)])
    v = np.where(t > rest, 0.01, 0.0)
    _, force = pushed(
        ("dwell_stiction", "lugre"), v, t, **{k.replace(".", "__"): v for k, v in FC.items()},
        lugre__sigma0=1e8, dwell_stiction__a=0.4, dwell_stiction__gamma=1.0, dwell_stiction__d=5e-4,
    )  # fmt: skip
    assert force.max() == pytest.approx(150 * (1 + 0.4 * rise), rel=0.01)
    assert force[-1] == pytest.approx(150 * (1 + 0.4 * rise * np.exp(-0.4 / 0.5)), rel=0.02)  # 0.4 mm on


def test_friction_follows_velocity_late_as_in_equation_2_9():
    # At a velocity that falls steadily, friction is what it was a time constant earlier.
    t = np.arange(40001) * 1e-5
    v, changes = 0.02 - 0.04 * t, {"lugre__sigma0": 1e8, "lugre__sigma1": 0.0, "lugre__sigma2": 0.0, "lugre__vs": 5e-3}
    _, on_time = pushed(("lugre",), v, t, **changes)
    _, late = pushed(("frictional_memory", "lugre"), v, t, frictional_memory__tau=0.02, **changes)
    middle = slice(25000, 38000)
    assert late[middle] == pytest.approx(on_time[slice(23000, 36000)], rel=2e-3)
    assert abs(late[middle] - on_time[middle]).max() > 5.0


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("speed", [1e-3, 5e-3, 8e-3])
def test_the_stribeck_curve_has_an_exponent_as_in_equation_2_5(exponent, speed):
    t = np.linspace(0, 0.01 / speed, 2001)
    changes = {"lugre__sigma1": 0.0, "lugre__sigma2": 0.0, "lugre__vs": 5e-3, "stribeck_exponent__e": exponent}
    _, force = pushed(("stribeck_exponent", "lugre"), np.full(2001, speed), t, **changes)
    assert force[-1] == pytest.approx(150 + 50 * np.exp(-((speed / 5e-3) ** exponent)), rel=1e-6)


def test_forces_are_what_their_equations_say():
    t, still = np.linspace(0, 1, 101), np.zeros(101)
    slide = np.full(101, 0.02)
    assert pushed(("quadratic_drag",), -slide, t)[1][-1] == pytest.approx(-5e3 * 4e-4)
    assert pushed(("hardening_spring",), still, t, x0=0.02)[1][-1] == pytest.approx(5e6 * 8e-6)
    assert pushed(("force_offset_drift",), still, t)[1][-1] == pytest.approx(2.0)
    x, force = pushed(("flow_force",), slide, t)
    assert x[np.argmax(force)] == pytest.approx(0.008, abs=2e-4)
    assert np.interp([0.008, 0.014], x, force) == pytest.approx([60.0, 30.0], rel=1e-3)
    _, force = pushed(("periodic_force",), still, t, periodic_force__a=3.0, periodic_force__b=4.0)
    assert abs(force).max() == pytest.approx(5.0, rel=1e-2)
    x, force = pushed(("position_periodic_force",), slide, t, position_periodic_force__b=0.0)
    assert force == pytest.approx(10 * np.sin(2 * np.pi * x / 5e-3), abs=1e-9)


def test_a_contact_below_is_a_negative_one_and_a_stiffer_spring():
    t, v = np.linspace(0, 1, 401), np.full(401, 0.024)
    x, above = pushed(("contact_stiffness",), v, t)
    assert above == pytest.approx(2e4 * np.maximum(x - 0.012, 0), abs=0.3)
    _, below = pushed(
        ("contact_stiffness", "spring"), v, t, contact_stiffness__k=-2e4, spring__K=2e4, spring__F0=-240.0
    )
    assert below == pytest.approx(2e4 * np.minimum(x - 0.012, 0), abs=0.3)


def test_presliding_hysteresis_saturates_and_closes_its_loops():
    turns = np.array([0.0, 1e-3, 2e-4, 6e-4, 4e-4, 6e-4, 1e-3])
    x = np.concatenate([np.linspace(a, b, 201)[1:] for a, b in itertools.pairwise(turns)])
    t = np.arange(len(x)) * 1e-3
    k = kernel(("nonlocal_presliding",), "motion")
    imposed = np.column_stack([x, 0 * x, 0 * x, 0 * x])
    force = k.run(t, imposed, k.vector(TYPICAL), k.start()).outputs[:, 0]
    first, down, inner, closed, last = (force[200 * i - 1] for i in (1, 2, 3, 5, 6))
    assert (first, last) == (pytest.approx(60.0), pytest.approx(60.0))
    assert closed == pytest.approx(inner, abs=1e-9)
    assert down < inner < first


def test_actuator_hysteresis_is_behind_by_its_width():
    effect = CATALOGUE["actuator_hysteresis"]
    p, held = {"h": 20.0, "r": 100.0}, {f"w{i}": 0.0 for i in range(1, 5)}
    behind = {}
    for u in (300.0, 100.0, 200.0, 0.0, 200.0):
        q = Quantities(0.0, 0.0, 0.0, 0.0, u, 0.0)
        held = {name: float(value) for name, value in effect.jump(q, p, held).items()}
        behind.setdefault(u, []).append(u - float(effect.input(q, p, held)))
    assert behind[300.0] == [pytest.approx(20.0)]
    assert behind[100.0] == behind[0.0] == [pytest.approx(-20.0)]
    assert behind[200.0][1] == pytest.approx(20.0)
    assert -20.0 < behind[200.0][0] < 20.0


def test_a_curved_sensor_is_right_at_its_ends_and_off_by_its_share_between():
    effect, y = CATALOGUE["sensor_nonlinearity"], np.linspace(0, 0.03, 3001)

    def off(**p):
        q = Quantities(0.0, 0.0, 0.0, 0.0, 0.0, y)
        return effect.output(q, {"q": 0.0, "c": 0.0, "L": 0.03} | p, {}) - y

    arch, wave = off(q=0.02), off(c=0.02)
    assert (arch[0], wave[0], arch[-1], wave[-1]) == (0, 0, pytest.approx(0, abs=1e-15), pytest.approx(0, abs=1e-15))
    assert (arch.max(), abs(wave).max()) == (pytest.approx(0.02 * 0.03), pytest.approx(0.02 * 0.03, rel=1e-4))
    assert wave[1500] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(("effect", "changes"), [("backlash", {"width": 4e-4}), ("sensor_drift", {"r": 1e-4})])
def test_sensors_show_what_they_should(effect, changes):
    k, t = kernel((*BASE, effect)), np.arange(1501) / 500.0
    u = 900 + 500 * np.sin(2 * np.pi * t / 3)
    own = {f"{effect}.{symbol}": value for symbol, value in changes.items()}
    run = k.run(t, u, k.vector(TYPICAL | own), k.start(0.02, force=900.0), h_max=5e-4).outputs[:, 0]
    plain = kernel(BASE)
    x = plain.run(t, u, plain.vector(TYPICAL), plain.start(0.02), h_max=5e-4).outputs[:, 0]
    off = run - x
    if effect == "sensor_drift":
        assert off == pytest.approx(1e-4 * t, abs=1e-9)
    else:
        assert (off.min(), off.max()) == (pytest.approx(-2e-4, rel=1e-3), pytest.approx(2e-4, rel=1e-3))


def test_force_gain_is_a_change_of_all_other_scales():
    t = np.arange(501) / 500.0
    u = 900 + 500 * np.sin(2 * np.pi * t)
    scaled = {"mass.m", "spring.K", "spring.F0", "lugre.fc", "lugre.fs", "lugre.sigma0", "lugre.sigma1", "lugre.sigma2"}
    gained, plain = kernel((*BASE, "force_gain")), kernel(BASE)
    weak = TYPICAL | {name: TYPICAL[name] / 1.1 for name in scaled}
    found = gained.run(t, u, gained.vector(TYPICAL | {"force_gain.g": 0.1}), gained.start(0.02), h_max=5e-4).outputs
    assert found == pytest.approx(plain.run(t, u, plain.vector(weak), plain.start(0.02), h_max=5e-4).outputs, abs=1e-9)
