"""Armstrong's seven-parameter model: its equations, and Table 2.2 of the source document by simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from recordings import BadParameter
from simulator.friction import CAPABILITIES, TYPICAL_RANGES, Drive, SevenParameters, simulate_drive

STEP = 1e-4
PD = Drive(mass=1.0, stiffness=1000.0, damping=5.0)
PID = Drive(mass=1.0, stiffness=1000.0, damping=60.0, integral=1500.0)


def parameters(**changes):
    return SevenParameters(
        **{"coulomb": 10.0, "viscous": 0.0, "stribeck": 0.0, "stiffness": 1e6, "speed": 1e-3, **changes}
    )


STATIC = parameters(stribeck=5.0, speed=1e-5)  # a level that is gone as soon as it moves
STRIBECK = parameters(stribeck=5.0)


def pulled(friction, speed=5e-3, drive=PD, seconds=20.0, moving=False):
    """Second half of a pull at constant speed: range of the force, breaks away, share of time that it sticks."""
    t = np.arange(0, seconds, STEP)
    start = (-10.0 / drive.stiffness, speed) if moving else (0.0, 0.0)
    run = simulate_drive(friction, drive, speed * t, STEP, start)
    late = slice(len(t) // 2, None)
    return np.ptp(run.force[late]), run.slips, run.sticking[late].mean()


def hunting(friction):
    """Range of the position in the second half of a minute at a constant set point."""
    t = np.arange(0, 60, STEP)
    run = simulate_drive(friction, PID, np.where(t > 0.1, 0.01, 0.0), STEP)
    return np.ptp(run.x[len(t) // 2 :])


def test_viscous_friction_is_stable():
    viscous = parameters(coulomb=0.0, viscous=20.0)
    assert pulled(viscous)[2] == 0
    assert hunting(viscous) < 1e-6


def test_coulomb_friction_neither_sticks_and_slips_nor_hunts():
    force, _, sticking = pulled(parameters())
    assert sticking == 0
    assert force < 0.1
    assert hunting(parameters()) < 1e-6


def test_static_friction_sticks_and_slips_from_some_starts_only_and_hunts():
    force, slips, _ = pulled(STATIC)
    assert slips > 5
    assert force > 8
    assert pulled(STATIC, moving=True)[1:] == (0, 0.0)
    assert hunting(STATIC) > 1e-3


def test_the_stribeck_curve_decides_from_which_starts():
    # Moving at 5 mm/s, a level that is gone at once leaves it moving, a curve of 1 mm/s does not.
    assert pulled(STRIBECK, moving=True)[1] > 5
    assert pulled(STRIBECK, speed=0.05, moving=True)[1] == 0


def test_rising_static_friction_ties_the_amplitude_to_the_velocity():
    speeds = (1e-3, 5e-3, 15e-3)
    without = [pulled(STRIBECK, speed)[0] for speed in speeds]
    rising = [pulled(parameters(stribeck=5.0, rise=1.0), speed)[0] for speed in speeds]
    assert np.ptp(without) < 0.02 * without[0]
    assert rising[0] > rising[1] > rising[2]
    assert rising[2] < 0.9 * rising[0]


def test_frictional_memory_ties_the_amplitude_to_the_stiffness():
    def amplitudes(memory):
        friction = parameters(stribeck=5.0, memory=memory)
        return [pulled(friction, 1e-3, Drive(1.0, stiffness, 5.0))[0] for stiffness in (2e3, 3.2e4)]

    soft, stiff = amplitudes(0.0)
    assert stiff > soft
    soft, stiff = amplitudes(0.01)
    assert stiff < 0.97 * soft


def test_presliding_gives_small_displacements_while_it_sticks():
    t = np.arange(0, 1, STEP)
    reference = 2.5e-3 * (1 - np.cos(2 * np.pi * t))  # 5 N at most: it never breaks away
    run = simulate_drive(STRIBECK, Drive(1.0, 1000.0), reference, STEP)
    assert run.slips == 0
    assert run.x == pytest.approx(reference * 1e3 / (1e6 + 1e3), abs=5e-8)


def test_sliding_is_equation_2_9_and_the_force_does_not_jump_on_arrival():
    friction = parameters(stribeck=5.0, viscous=3.0, memory=0.02)
    t = np.arange(0, 9, STEP)
    run = simulate_drive(friction, PD, 5e-3 * t, STEP)
    slipping = ~run.sticking
    late = np.interp(t - 0.02, t, run.v, left=0.0)
    expected = -(10 + 5 / (1 + (late / 1e-3) ** 2) + 3 * run.v)
    assert run.friction[slipping] == pytest.approx(expected[slipping], abs=0.1)
    arrived = np.flatnonzero(np.diff(run.sticking.astype(int)) > 0)
    assert len(arrived)
    assert np.abs(run.friction[arrived + 1] - run.friction[arrived]).max() < 0.3


def test_one_slip_solves_its_differential_equation():
    friction, speed = parameters(stribeck=5.0), 5e-3
    t = np.arange(0, 6, STEP)
    run = simulate_drive(friction, PD, speed * t, STEP)
    begin = np.flatnonzero(~run.sticking)[0]
    end = begin + np.flatnonzero(run.sticking[begin:])[0]

    def motion(s, y):
        level = 10 + 5 / (1 + (y[1] / 1e-3) ** 2)
        return [y[1], 1000 * (speed * s - y[0]) + 5 * (speed - y[1]) - level]

    span = t[begin], t[end - 1]
    solved = solve_ivp(
        motion, span, [run.x[begin], run.v[begin]], t_eval=t[begin:end], rtol=1e-9, atol=1e-12, method="LSODA"
    )
    assert run.x[begin:end] == pytest.approx(solved.y[0], abs=0.01 * np.ptp(run.x[begin:end]))


def test_break_away_is_equation_2_10():
    friction = parameters(stribeck=5.0, rise=2.0)
    t = np.arange(0, 20, STEP)
    run = simulate_drive(friction, PD, 2e-3 * t, STEP)
    away = np.flatnonzero(np.diff(run.sticking.astype(int)) < 0)
    arrived = np.flatnonzero(np.diff(run.sticking.astype(int)) > 0)
    for k in away[1:]:
        rest = (k - arrived[arrived < k][-1]) * STEP
        # at arrival the velocity is 0, so all of the level before is there: F_s,a is the level of the slip before
        before = abs(run.friction[arrived[arrived < k][-1]]) - 10
        expected = 10 + before + (5 - before) * rest / (rest + 2.0)
        assert abs(run.friction[k]) == pytest.approx(expected, abs=0.1)


def test_the_tables_are_there():
    names = set(vars(parameters()))
    assert {row.parameter for row in TYPICAL_RANGES} == names
    assert all(row.high is None or 0 <= row.low < row.high for row in TYPICAL_RANGES)
    assert len(CAPABILITIES) == 7


def test_what_is_no_drive_is_refused():
    for name in ("stiffness", "speed"):
        with pytest.raises(BadParameter, match=f"{name} 0: it is out of range; more than 0"):
            parameters(**{name: 0.0})
    with pytest.raises(BadParameter, match="memory -1"):
        parameters(memory=-1.0)
    with pytest.raises(BadParameter, match="mass 0"):
        Drive(0.0, 1.0)
    with pytest.raises(BadParameter, match=r"step 0\.01: it does not resolve"):
        simulate_drive(STRIBECK, PD, np.zeros(5), 0.01)
    with pytest.raises(BadParameter, match="reference"):
        simulate_drive(STRIBECK, PD, np.array([np.nan, 0.0]))
