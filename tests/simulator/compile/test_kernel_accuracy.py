"""The kernel against an independent solution: order of convergence, both causalities, inputs and time grids."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from lugre_reference import STROKE, Valve, break_aways, slow_force, solve

from simulator import BASE, kernel

STIFFNESSES = [1e4, 1e5, 1e6, 1e7, 1e8]
T = np.linspace(0.0, 1.6, 801)
STEPS = [2e-3 / 2**i for i in range(3, 8)]


@functools.cache
def reference(sigma0):
    """Valve, start and trajectory x, v, z at the times T."""
    valve = Valve.stiff(sigma0)
    start = np.array([(slow_force(0.0) - valve.F0) / valve.K, 0.0, 0.0])
    return valve, start, solve(lambda t, s: valve.motion(t, s, slow_force), start, T)


def simulate(valve, start, h):
    """Position at the times T with a sampling interval and step h."""
    k = kernel(BASE)
    t = np.linspace(T[0], T[-1], round((T[-1] - T[0]) / h) + 1)
    scan = k.run(t, slow_force(t), k.vector(valve.values()), start)
    assert scan.failed is None
    return scan.outputs[:: (len(t) - 1) // (len(T) - 1), 0]


@pytest.mark.parametrize(
    "sigma0", [pytest.param(one, marks=() if one in (1e5, 1e8) else pytest.mark.slow) for one in STIFFNESSES]
)
def test_the_step_is_of_second_order_on_stick_slip_trajectories(way, sigma0):
    valve, start, (x, v, z) = reference(sigma0)
    assert break_aways(valve, v, z) >= 3
    assert np.ptp(x) > 0.3 * STROKE
    errors = [abs(simulate(valve, start, h) - x).max() for h in STEPS]
    order = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert 1.9 < order < 2.2
    assert errors[-1] < 1e-6 * STROKE


def test_a_coarse_step_stays_bounded_at_the_stiffest_bristle(way):
    valve, start, (x, _, _) = reference(1e8)
    assert abs(simulate(valve, start, 2e-3) - x).max() < 0.03 * STROKE


def test_the_imposed_motion_gives_the_force_back(way):
    valve, start, _ = reference(1e6)
    t = np.linspace(0.0, 0.4, 4001)
    x, v, z = solve(lambda t, s: valve.motion(t, s, slow_force), start, t)
    a = valve.motion(t, (x, v, z), slow_force)[1]
    k = kernel(BASE, "motion")
    errors = []
    for every in (8, 4, 2, 1):
        motion = np.column_stack([x, v, a, 0 * t])[::every]
        scan = k.run(t[::every], motion, k.vector(valve.values()), k.start())
        errors.append(abs(scan.outputs[:, 0] - slow_force(t[::every])).max())
    assert errors[-1] < 1e-4 * np.ptp(slow_force(T))
    assert np.log2(errors[0] / errors[-1]) / 3 > 1.7


def run(t, u, **options):
    k = kernel(BASE)
    return k.run(t, u, k.vector(Valve().values()), k.start(0.01), **options).outputs[:, 0]


def test_sub_steps_are_those_of_a_finer_grid(way):
    t = np.linspace(0, 0.4, 101)
    fine = np.linspace(0, 0.4, 401)
    expected = run(fine, np.interp(fine, t, slow_force(t)))[::4]
    for h_max in (1e-3, 1.1e-3, 1.3e-3):
        assert run(t, slow_force(t), h_max=h_max) == pytest.approx(expected, abs=1e-13)
    assert abs(run(t, slow_force(t), h_max=5e-3) - expected).max() > 1e-9


def test_held_inputs_stay_until_the_next_sample(way):
    t = np.linspace(0, 0.4, 201)
    u = slow_force(t)
    k = kernel(BASE)
    state, expected = k.start(0.01), [0.01]
    for i in range(200):
        constant = k.run(t[i : i + 2], u[[i, i]], k.vector(Valve().values()), state, h_max=5e-4)
        state, expected = constant.final, [*expected, constant.outputs[1, 0]]
    assert run(t, u, hold=True, h_max=5e-4) == pytest.approx(np.array(expected), abs=1e-13)
    assert abs(run(t, u, h_max=5e-4) - expected).max() > 1e-6


def test_the_time_need_not_be_uniform(way):
    rng = np.random.default_rng(3)
    fine = np.linspace(0, 0.6, 60001)
    kept = np.unique(np.r_[0, 60000, rng.integers(1, 60000, 300)])
    u = np.interp(fine, fine[kept], slow_force(fine[kept]))
    assert run(fine[kept], u[kept], h_max=1e-5) == pytest.approx(run(fine, u)[kept], abs=1e-9)


def test_values_that_replace_states_start_a_new_run(way):
    t = np.linspace(0, 0.4, 201)
    u, k = slow_force(t), kernel(BASE)
    p, fresh = k.vector(Valve().values()), np.array([0.013, 0.02, -5e-5])
    resets = np.full((201, 3), np.nan)
    resets[100] = fresh
    scan = k.run(t, u, p, k.start(0.01), resets=resets, sensitivities=True)
    again = k.run(t[100:], u[100:], p, fresh, sensitivities=True)
    bristle = k.run(t[:101], u[:101], p, k.start(0.01), sensitivities=True).final_jacobian[2]
    known = again.jacobian[1:, :, :9] + again.jacobian[1:, :, 11:] * bristle[:9]  # it depends on p as before
    assert scan.outputs[101:] == pytest.approx(again.outputs[1:], abs=1e-15)
    assert scan.jacobian[101:, :, :9] == pytest.approx(known, rel=1e-12, abs=1e-15)
    assert scan.jacobian[101:, :, 9:] == pytest.approx(again.jacobian[1:, :, 11:] * bristle[9:], rel=1e-12, abs=1e-15)
    assert scan.outputs[:101] == pytest.approx(k.run(t[:101], u[:101], p, k.start(0.01)).outputs, abs=1e-13)
