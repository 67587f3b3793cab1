"""Velocity from position: filters against filterpy, closed forms, and the truth."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from detector import HighPass, Kalman, SteadyKalman


def filtered(velocity, t, x):
    """Position and velocity of a filter over a row without gaps."""
    dt = np.concatenate([[0.0], np.diff(t)])
    return velocity.run(velocity.start(), dt, x, np.full(len(t), np.nan))[1:]


def noisy(n, dt, noise, seed=1):
    t = dt * np.arange(n)
    x = 0.02 * np.sin(2 * np.pi * 0.5 * t)
    v = 0.02 * np.pi * np.cos(2 * np.pi * 0.5 * t)
    return t, x + noise * np.random.default_rng(seed).standard_normal(n), v


def test_kalman_is_filterpys_object():
    t, x, _ = noisy(300, 0.01, 1e-4)
    kf = KalmanFilter(dim_x=3, dim_z=1)
    kf.x, kf.H, kf.R = np.array([x[0], 0.0, 0.0]), np.array([[1.0, 0.0, 0.0]]), np.array([[1e-8]])
    kf.P, d = np.diag([1e-8, 1e6, 1e6]), 0.01
    kf.F = np.array([[1, d, d * d / 2], [0, 1, d], [0, 0, 1]])
    kf.Q = np.array([[d**5 / 20, d**4 / 8, d**3 / 6], [d**4 / 8, d**3 / 3, d**2 / 2], [d**3 / 6, d**2 / 2, d]])
    expected = [x[0]]
    speeds = [0.0]
    for z in x[1:]:
        kf.predict()
        kf.update(z)
        expected.append(kf.x[0])
        speeds.append(kf.x[1])
    position, velocity = filtered(Kalman(noise=1e-4, jerk=1.0), t, x)
    assert position == pytest.approx(expected, abs=1e-12)
    assert velocity == pytest.approx(speeds, abs=1e-8)


@pytest.mark.parametrize(
    ("dt", "noise", "jerk"),
    [(1e-4, 1e-4, 1.0), (1e-3, 1e-5, 1.0), (0.01, 1e-4, 1.0), (0.1, 1e-3, 0.01), (1.0, 1e-4, 1.0)],
)
def test_the_steady_gain_is_what_filterpys_filter_settles_to(dt, noise, jerk):
    kf = KalmanFilter(dim_x=3, dim_z=1)
    kf.H, kf.R, kf.P = np.array([[1.0, 0.0, 0.0]]), np.array([[noise**2]]), np.diag([noise**2, 1.0, 1.0])
    kf.F = np.array([[1, dt, dt * dt / 2], [0, 1, dt], [0, 0, 1]])
    kf.Q = jerk * np.array(
        [[dt**5 / 20, dt**4 / 8, dt**3 / 6], [dt**4 / 8, dt**3 / 3, dt**2 / 2], [dt**3 / 6, dt**2 / 2, dt]]
    )
    for _ in range(3000):
        kf.predict()
        kf.update(0.0)
    expected = kf.K.ravel() * [1.0, dt, dt * dt]
    found = SteadyKalman(noise, jerk, dt).gains
    assert found[len(found) // 2] == pytest.approx(expected, rel=1e-6)


def test_the_steady_filter_follows_the_full_one_when_samples_come_irregularly():
    rng = np.random.default_rng(3)
    t = np.cumsum(0.01 * rng.uniform(0.8, 1.2, 2000))
    x = 0.02 * np.sin(np.pi * t) + 1e-4 * rng.standard_normal(2000)
    truth = 0.02 * np.pi * np.cos(np.pi * t)
    _, full = filtered(Kalman(1e-4, 1.0), t, x)
    _, steady = filtered(SteadyKalman(1e-4, 1.0, 0.01), t, x)
    late = slice(500, None)
    errors = [np.std((v - truth)[late]) for v in (full, steady)]
    assert errors[1] < 1.02 * errors[0] < 0.004
    assert np.std((full - steady)[late]) < 0.2 * errors[0]


def test_the_filter_beats_the_difference_quotient_fifty_times():
    t, x, v = noisy(4000, 1e-3, 1e-4)
    _, velocity = filtered(SteadyKalman(1e-4, 1.0, 1e-3), t, x)
    assert np.std((velocity - v)[1000:]) < 0.02 * np.std(np.diff(x) / 1e-3 - v[1:])


def test_high_pass_is_exact_for_ramps():
    t = np.cumsum([0.0, 1e-3, 5e-3, 2e-3])
    _, velocity = filtered(HighPass(2e-3), t, 0.3 * t)
    assert velocity == pytest.approx(0.3 * (1.0 - np.exp(-t / 2e-3)), rel=1e-13)


@pytest.mark.parametrize("velocity", [HighPass(), Kalman(1e-4, 1.0), SteadyKalman(1e-4, 1.0, 0.01)])
def test_samples_passed_over_leave_the_state_alone(velocity):
    started = velocity.run(velocity.start(), np.array([0.0, 0.01]), np.array([0.0, 0.1]), np.full(2, np.nan))[0]
    state, _, speed = velocity.run(started, np.array([np.nan]), np.array([np.nan]), np.array([np.nan]))
    assert np.array_equal(state, started)
    assert np.isnan(speed).all()
    assert np.isfinite(started).all()
