"""A noisy force: what is estimated of it, which estimator is chosen, what comes out, and that a failure says so."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray
from seeded_valves import changed, recorded

from identification import Fit, Outcome, experiment, fit, identify, uncertainty_of
from identification.data.force import estimate_force
from identification.data.force import loops as force_loops
from identification.data.grid import Grid, grids
from identification.estimators.noise_aware.linearised_model import first_path, loops
from identification.estimators.noise_aware.recursions import RUNAWAY
from recordings import Recording
from simulator import BASE, Excitation, Sensors, kernel, random_valve, simulate

SEED = 7
TRUTH, STROKE = random_valve(SEED)
FORCE_NOISE = 1e-3 * TRUTH["spring.K"] * STROKE


@functools.cache
def noisy() -> tuple[Recording, Recording]:
    sensors = Sensors(500.0, position_noise=2e-4 * STROKE, force_noise=FORCE_NOISE)
    runs = [simulate(TRUTH, Excitation.parse(e), sensors, stroke=STROKE, seed=s)
            for s, e in enumerate(("staircase:20", "sine:25"))]  # fmt: skip
    return runs[0][0], runs[1][0]


@functools.cache
def found() -> Fit:
    return fit([experiment(r) for r in noisy()])


def breakaway_error(values: dict[str, float]) -> float:
    excess = values["lugre.fs"] - values["lugre.fc"]
    return abs(excess / (TRUTH["lugre.fs"] - TRUTH["lugre.fc"]) - 1)


def test_the_filter_is_that_of_an_independent_implementation():
    rng, n, s, m = np.random.default_rng(1), 40, 4, 2
    F, G = np.eye(s) + 0.1 * rng.normal(size=(n - 1, s, s)), rng.normal(size=(n - 1, s, m))
    H, D, jump = rng.normal(size=(n, 2, s)), np.zeros((n, 2, m)), rng.normal(size=(n - 1, s))
    Q, R, E = np.tile(0.1 * np.eye(s), (n - 1, 1, 1)), np.full((n, 2), 0.5), rng.normal(size=(n, 3))
    A, P, S = np.zeros((n, s)), np.zeros((n, s, s)), np.zeros((n, s, m))
    P[0] = np.eye(s)
    V, J, K, measured = np.empty((n, 3)), np.empty((n, 3, m)), np.empty((n, 3, s)), E.copy()
    loops().filtered(E, H, D, F, G, jump, Q, R, A, P, S, V, J, K)
    other, held = KalmanFilter(dim_x=s, dim_z=1), 0
    other.P = np.eye(s)
    for k in range(n):
        for c in range(2):
            other.update(measured[k, c], R=R[k, c], H=H[k, c][None])
            assert E[k, c] == pytest.approx(other.y.item(), rel=1e-8, abs=1e-10)
            assert V[k, c] == pytest.approx(other.S.item(), rel=1e-8)
        if other.P[1, 1] > RUNAWAY**2:  # the second state, a velocity, is then held to that of the path
            held += 1
            other.update(0.0, R=RUNAWAY**2, H=np.eye(s)[1][None])
            assert E[k, 2] == pytest.approx(other.y.item(), rel=1e-8, abs=1e-10)
            assert V[k, 2] == pytest.approx(other.S.item(), rel=1e-8)
        else:
            assert np.isinf(V[k, 2])
        if k + 1 < n:
            other.predict(u=jump[k][:, None], B=np.eye(s), F=F[k], Q=Q[k])
    assert 0 < held < n


def test_the_way_back_gives_the_gradient_of_the_squares_by_the_predicted_states():
    rng, n, s, m = np.random.default_rng(6), 30, 4, 2
    F, G = np.eye(s) + 0.1 * rng.normal(size=(n - 1, s, s)), rng.normal(size=(n - 1, s, m))
    H, D, jump = rng.normal(size=(n, 2, s)), np.zeros((n, 2, m)), rng.normal(size=(n - 1, s))
    Q, R, measured = np.tile(0.1 * np.eye(s), (n - 1, 1, 1)), np.full((n, 2), 0.5), rng.normal(size=(n, 3))

    def half_squares(jump: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        A, P, S = np.zeros((n, s)), np.zeros((n, s, s)), np.zeros((n, s, m))
        P[0] = np.eye(s)
        E, V, J, K = measured.copy(), np.empty((n, 3)), np.empty((n, 3, m)), np.empty((n, 3, s))
        loops().filtered(E, H, D, F, G, jump, Q, R, A, P, S, V, J, K)
        out, adjoints = np.empty((n, s)), np.empty((n, s))
        loops().smoothed(A, P, S, E, V, J, K, H, F, np.zeros(m), out, adjoints)
        return float(np.sum(np.where(np.isfinite(V), E**2 / V, 0.0))) / 2, adjoints

    _, adjoints = half_squares(jump)
    for k in (0, 7, n - 2):
        for i in range(s):
            up, down = jump.copy(), jump.copy()
            up[k, i] += 1e-4
            down[k, i] -= 1e-4
            slope = (half_squares(up)[0] - half_squares(down)[0]) / 2e-4
            assert adjoints[k + 1, i] == pytest.approx(slope, rel=1e-6, abs=1e-8)


def test_the_error_of_the_smoothed_force_is_known():
    t = np.arange(10000) / 500.0
    true = 400 + 300 * np.sin(0.9 * t) + 50 * np.clip(t - 10, 0, 4)
    force = estimate_force(t, true + np.random.default_rng(2).normal(0, 1.5, len(t)), 1.5)
    z = (force.u - true) / force.std
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.25
    assert np.sqrt(np.mean((force.u - true) ** 2)) < 0.4 * 1.5


def test_a_force_at_rest_is_seen_to_rest_between_its_steps():
    t = np.arange(10000) / 500.0
    true = 100.0 * np.random.default_rng(3).integers(1, 9, 5)[np.minimum((t / 4).astype(int), 4)]
    force = estimate_force(t, true + np.random.default_rng(4).normal(0, 1.5, len(t)), 1.5)
    rest = (t % 4 > 0.3) & (t % 4 < 3.7)
    assert np.sqrt(np.mean((force.u - true)[rest] ** 2)) < 0.15 * 1.5
    assert np.max(np.abs(force.u - true)) < 6 * 1.5  # the steps themselves are followed


def grid_of(t: NDArray[np.float64], u: NDArray[np.float64], noise: float) -> Grid:
    """A grid of which only the force matters."""
    return Grid(t, t, u, estimate_force(t, u, noise), 1e-6, np.zeros((len(t), 3)))


def test_a_smooth_force_is_known_better_by_more_integrals_and_a_stepped_one_is_left_alone():
    t = np.arange(10000) / 500.0
    noise = np.random.default_rng(5).normal(0, 1.5, len(t))
    sines = 400 + sum(90 * np.sin(2 * np.pi * f * t + f) for f in (0.1, 0.27, 0.55, 0.8))
    smooth = grid_of(t, sines + noise, 1.5)
    assert np.std(smooth.free_force - sines) < 0.7 * np.std(smooth.force.u - sines)
    assert_allclose(smooth.divided(3).free_force[::3], smooth.free_force)
    steps = 100.0 * np.random.default_rng(3).integers(1, 9, 5)[np.minimum((t / 4).astype(int), 4)]
    stepped = grid_of(t, steps + noise, 1.5)
    assert_array_equal(stepped.free_force, stepped.force.u)


@pytest.mark.parametrize("order", [2, 4])
def test_the_force_is_smoothed_as_by_rauch_tung_and_striebel(order):
    rng, n, r = np.random.default_rng(6), 60, 0.8**2
    t = np.cumsum(rng.uniform(1e-3, 4e-3, n))
    unit = (t[-1] - t[0]) / (n - 1)
    u, q = 10 + np.cumsum(rng.normal(0, 1, n)), rng.uniform(0.5, 2, n - 1) * 1e4 / unit ** (2 * order - 2)
    mean, variance, jumps = np.empty((n, order)), np.empty(n), np.empty(n - 1)
    start = np.array([u[0], 0.3, 0.1, 0.02][:order])
    force_loops().smoothed_force(t, u, q, r, start, mean, variance, jumps)
    other = KalmanFilter(order, 1)
    other.x[:, 0], other.P = (
        start * unit ** -np.arange(order),
        1e4 * r * np.diag([unit ** (-2.0 * i) for i in range(order)]),
    )
    other.H, other.R = np.eye(order)[:1], r
    powers = np.subtract.outer(np.arange(order), np.arange(order))
    Fs = [np.array([[h**-k / math.factorial(-k) if k <= 0 else 0.0 for k in row] for row in powers])
          for h in np.diff(t)]  # fmt: skip
    Qs = [w * h * np.outer(F[:, -1], F[:, -1]) / (np.add.outer(-powers[:, -1], -powers[:, -1]) + 1)
          for F, w, h in zip(Fs, q, np.diff(t), strict=True)]  # fmt: skip
    xs, Ps = [], []
    for k in range(n):
        other.update(u[k])
        xs.append(other.x.copy())
        Ps.append(other.P.copy())
        if k + 1 < n:
            other.predict(F=Fs[k], Q=Qs[k])
    x, P, K, _ = other.rts_smoother(np.array(xs), np.array(Ps), [Fs[0], *Fs], [Qs[0], *Qs])  # of the interval before
    size = np.abs(x[:, :, 0]).max(axis=0)
    assert_allclose(mean / size, x[:, :, 0] / size, atol=1e-6)
    assert_allclose(variance, P[:, 0, 0], rtol=1e-5)
    both = [K[k][-1] @ P[k + 1][:, -1] for k in range(n - 1)]
    expected = np.diff(x[:, -1, 0]) ** 2 + P[1:, -1, -1] + P[:-1, -1, -1] - 2 * np.array(both)
    assert_allclose(jumps, expected, rtol=1e-4)


def test_the_noise_of_both_channels_is_estimated_from_the_recording():
    for recording in noisy():
        e = experiment(recording)
        assert e.noise_force == pytest.approx(FORCE_NOISE, rel=0.1)
        assert e.noise_position == pytest.approx(2e-4 * STROKE, rel=0.1)


@pytest.mark.slow
def test_a_noisy_force_is_estimated_along_with_the_motion():
    assert found().estimator == "noise-aware"
    assert found().outcome is Outcome.CONVERGED
    values = found().values
    assert values["spring.K"] == pytest.approx(TRUTH["spring.K"], rel=1e-3)
    assert values["lugre.fc"] == pytest.approx(TRUTH["lugre.fc"], rel=1e-2)
    assert breakaway_error(values) < 0.1


@pytest.mark.slow
def test_its_free_run_is_on_the_smoothed_force_and_near_the_noise():
    known = uncertainty_of(found())
    assert all(known.spread[name] > 0 for name in known.names)
    problem, path = found().problem, found().minimum
    assert problem is not None
    assert path is not None
    recordings_force = np.concatenate([experiment(r).segments[0].u for r in noisy()])
    used = np.concatenate([p.segment.u for p in problem.pieces])
    assert 0.7 * FORCE_NOISE < np.std(used - recordings_force) < 1.3 * FORCE_NOISE


def test_an_exact_force_is_taken_for_exact():
    assert fit([experiment(recorded(2))]).estimator == "output-error"


@pytest.mark.slow
def test_what_no_valve_does_is_said_not_to_have_converged():
    sensors = Sensors(250.0, position_noise=2e-4 * STROKE, force_noise=FORCE_NOISE)
    plain = simulate(TRUTH, Excitation.parse("sine:5"), sensors, stroke=STROKE, seed=3)[0]
    other = 0.3 * TRUTH["lugre.fc"] * np.sin(20 * np.asarray(plain.time))
    outcome = identify([changed(plain, force=plain["force"].values + other)], check=False)
    assert outcome.fit.outcome is Outcome.NOT_CONVERGED
    known = outcome.uncertainty
    assert set(known.status.values()) == {"unresolved"}
    assert all("did not converge" in known.note[name] for name in known.names)
    assert known.std == {}
    assert all(known.spread[name] > 0 for name in known.names)
    assert all(value.std is None for value in outcome.model.parameters.values())


@pytest.mark.long
def test_the_whole_identification_says_which_estimator_it_used():
    found = identify(noisy(), check=False)
    assert found.model.quality["estimator"] == "noise-aware"
    assert found.model.noise["force_N"] == pytest.approx(FORCE_NOISE, rel=0.1)


def test_a_part_of_a_recording_remembers_what_came_before_it():
    hysteresis = kernel((*BASE, "actuator_hysteresis"), "force with error")
    p = hysteresis.vector(TRUTH | {"actuator_hysteresis.h": 40.0, "actuator_hysteresis.r": 100.0})
    [whole] = grids([experiment(noisy()[0])])
    plays = [i for i, name in enumerate(hysteresis.states) if name.startswith("actuator_hysteresis.")]
    path, part = first_path(hysteresis, whole, p), first_path(hysteresis, whole.part(9000, 9500).part(100, 300), p)
    assert path is not None
    assert part is not None
    np.testing.assert_allclose(part[:, plays], path[9100:9300, plays], atol=1e-6)
    assert np.abs(path[9100, plays] - path[9100, -2]).max() > 50.0  # which is far from a start at the force


def test_a_part_begins_on_the_path_of_its_own_kernel_and_parameters():
    [whole] = grids([experiment(noisy()[0])])
    part, wide = whole.part(9000, 9500), {"actuator_hysteresis.h": 40.0, "actuator_hysteresis.r": 100.0}
    for damped, r in ((False, 100.0), (False, 60.0), (True, 60.0), (False, 100.0)):
        model = kernel((*BASE, "actuator_hysteresis"), "force with error", damped=damped)
        p = model.vector(TRUTH | wide | {"actuator_hysteresis.r": r})
        plays = [i for i, name in enumerate(model.states) if name.startswith("actuator_hysteresis.")]
        begun, path = first_path(model, part, p), first_path(model, whole, p)
        np.testing.assert_allclose(begun[0, plays], path[9000, plays], atol=1e-6)
