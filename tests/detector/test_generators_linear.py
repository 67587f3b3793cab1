"""The linear residual generators against their theory, on linear plants."""

from __future__ import annotations

import numpy as np
import pytest

from detector.generators import (
    LinearPlant,
    MatchedFilters,
    dfd,
    dfi,
    full_order,
    functional,
    least_order,
    settled,
    static,
    temporal,
)
from recordings import BadInput

A = np.array([[0.9, 0.2, 0.0], [-0.1, 0.8, 0.1], [0.0, 0.3, 0.7]])
B = np.array([[0.0], [0.5], [1.0]])
C = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
D = np.array([[0.1], [0.0]])
R1 = np.hstack([B, np.zeros((3, 2))])
R2 = np.hstack([D, np.eye(2)])
"""Faults: actuator, first sensor, second sensor."""

POLES = np.array([0.1, 0.2, 0.3])


@pytest.fixture
def plant():
    return LinearPlant(A, B, C, D, R1, R2)


def random_plant(seed, n=4, m=2):
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(n, n))
    matrix *= 0.95 / np.max(np.abs(np.linalg.eigvals(matrix)))
    return LinearPlant(matrix, rng.normal(size=(n, 2)), rng.normal(size=(m, n)), rng.normal(size=(m, 2)),
                       rng.normal(size=(n, 2)), rng.normal(size=(m, 2)))  # fmt: skip


def driven(plant, n=200, seed=0, x0=None, fault=None, at=100):
    rng = np.random.default_rng(seed)
    u, f = rng.normal(size=(n, plant.sizes[0])), np.zeros((n, plant.sizes[2]))
    if fault is not None:
        f[at:, fault] = 1.0
    return u, plant.simulate(u, x0, f), f


@pytest.mark.parametrize("seed", range(5))
def test_full_order_generator_meets_every_condition(seed):
    plant = random_plant(seed)
    watch = full_order(plant, np.linspace(0.1, 0.4, 4))
    found = watch.conditions(plant)
    assert found["F stable"] == pytest.approx(0.4, abs=1e-6)
    assert max(gap for name, gap in found.items() if name != "F stable") < 1e-12
    assert watch.holds(plant)


@pytest.mark.parametrize("seed", range(5))
def test_functional_generator_meets_every_condition_with_the_poles_asked_for(seed):
    plant = random_plant(seed)
    order = least_order(plant)
    watch = functional(plant, np.linspace(0.2, 0.4, order))
    assert watch.holds(plant, 1e-7)
    assert np.sort(np.abs(np.linalg.eigvals(watch.F))) == pytest.approx(np.linspace(0.2, 0.4, order), abs=1e-6)


def test_least_functional_order_is_below_the_order_and_within_the_bounds(plant):
    index = plant.observability_index
    assert plant.order / 2 <= index <= plant.order - 2 + 1
    assert least_order(plant) <= index < plant.order


def test_a_wrong_model_breaks_the_conditions(plant):
    watch = full_order(plant, POLES)
    other = LinearPlant(A * 0.9, B, C, D)
    assert not watch.holds(other)


@pytest.mark.parametrize(
    "make", [lambda p: full_order(p, POLES), lambda p: functional(p, [0.2, 0.3])], ids=["full", "functional"]
)
def test_residual_forgets_the_start_and_then_depends_on_faults_alone(plant, make):
    watch = make(plant)
    u, y, _ = driven(plant, x0=np.array([3.0, -2.0, 1.0]))
    residual = watch.run(watch.initial(), u, y)[1]
    assert np.abs(residual[:2]).max() > 0.01
    assert np.abs(residual[60:]).max() < 1e-9


@pytest.mark.parametrize("fault", range(3))
def test_fault_response_is_the_error_dynamics(plant, fault):
    watch = full_order(plant, POLES)
    u, y, f = driven(plant, fault=fault, at=0)
    residual = watch.run(watch.initial(), u, y)[1]
    assert residual == pytest.approx(watch.fault_response(plant, f), abs=1e-9)
    assert np.abs(residual).max() > 0.05


def test_an_unobservable_plant_is_refused_in_words():
    hidden = LinearPlant(np.diag([0.5, 0.6]), [[1.0], [1.0]], [[1.0, 0.0]])
    with pytest.raises(BadInput, match="not observable"):
        full_order(hidden, np.array([0.1, 0.2]))
    with pytest.raises(BadInput, match="unit circle"):
        full_order(LinearPlant(A, B, C), np.array([0.1, 0.2, 1.2]))


def test_a_functional_generator_that_does_not_exist_is_refused():
    single = LinearPlant(A, B, C[:1])
    with pytest.raises(BadInput, match="0 parity vectors"):
        functional(single, [0.1, 0.2])
    assert functional(single, POLES).holds(single, 1e-7)


def test_sampling_a_continuous_plant_matches_the_exponential():
    plant = LinearPlant.sampled(np.array([[-2.0]]), np.array([[1.0]]), np.array([[1.0]]), 0.1)
    assert plant.A[0, 0] == pytest.approx(np.exp(-0.2))
    assert plant.B[0, 0] == pytest.approx((1 - np.exp(-0.2)) / 2)


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(BadInput, match="C is"):
        LinearPlant(A, B, np.eye(2))


@pytest.mark.parametrize("depth", [2, 3])
def test_parity_relations_annihilate_the_state_and_show_the_faults(plant, depth):
    relations = temporal(plant, depth)
    assert np.abs(relations.V @ plant.observability(depth)).max() < 1e-12
    assert relations.detectable().all()
    u, y, _ = driven(plant, x0=np.array([5.0, 0.0, -5.0]))
    assert np.abs(relations.run(relations.initial(), u, y)[1]).max() < 1e-9


def test_parity_residual_is_the_evaluation_form(plant):
    """(3.16) computed from readings is (3.17): V M F."""
    relations = temporal(plant, 2)
    u, y, f = driven(plant, x0=np.ones(3), fault=1, at=50)
    residual = relations.run(relations.initial(), u, y)[1]
    for k in (50, 51, 52, 90):
        assert residual[k] == pytest.approx(relations.V @ relations.M @ f[k - 2 : k + 1].ravel(), abs=1e-9)


@pytest.mark.parametrize("fault", range(3))
def test_dfd_detects_and_dfi_names_the_fault(plant, fault):
    relations = temporal(plant, 3)
    u, y, _ = driven(plant, fault=fault)
    residual = relations.run(relations.initial(), u, y + 1e-3 * np.random.default_rng(1).normal(size=y.shape))[1]
    assert dfd(residual[50:90]).max() < 1e-4 < dfd(residual[110:]).min()
    assert (dfi(residual[110:], relations.directions()).argmax(axis=1) == fault).all()


def test_parity_that_does_not_exist_is_refused(plant):
    with pytest.raises(BadInput, match="over 0 steps"):
        temporal(plant, 0)


@pytest.mark.parametrize("sensor", range(4))
def test_redundant_sensors_are_isolated_by_their_directions(sensor):
    sensors = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]])
    relations = static(sensors)
    assert np.abs(relations.V @ sensors).max() < 1e-12
    x = np.random.default_rng(0).normal(size=(50, 2))
    y = x @ sensors.T
    assert np.abs(relations.run(relations.initial(), np.zeros((50, 0)), y)[1]).max() < 1e-12
    y[:, sensor] += 0.5
    residual = relations.run(relations.initial(), np.zeros((50, 0)), y)[1]
    assert (dfi(residual, relations.directions()).argmax(axis=1) == sensor).all()


def test_too_few_sensors_are_refused():
    with pytest.raises(BadInput, match="more sensors"):
        static(np.eye(2))


@pytest.fixture
def noisy(plant):
    """A filter, and a run of 4000 readings of a plant with the noise it was told."""
    rng, Q, R = np.random.default_rng(3), 0.01 * np.eye(3), 0.05 * np.eye(2)
    u, x, y = rng.normal(size=(4000, 1)), np.zeros(3), np.empty((4000, 2))
    for k in range(4000):
        y[k] = C @ x + D @ u[k] + rng.multivariate_normal(np.zeros(2), R)
        x = A @ x + B @ u[k] + rng.multivariate_normal(np.zeros(3), Q)
    return settled(plant, Q, R), u, y


def test_innovations_are_white_with_unit_covariance(noisy):
    watch, u, y = noisy
    r = watch.run(watch.initial(), u, y)[1][100:]
    assert np.cov(r.T) == pytest.approx(np.eye(2), abs=0.08)
    for lag in (1, 2, 5):
        assert np.abs(r[lag:].T @ r[:-lag] / len(r)).max() < 0.06
    assert np.abs(r.mean(axis=0)).max() < 0.06


def test_settled_gain_solves_the_riccati_equation(plant, noisy):
    from scipy.linalg import solve_discrete_are

    P = solve_discrete_are(A.T, C.T, 0.01 * np.eye(3), 0.05 * np.eye(2))
    assert noisy[0].gain == pytest.approx(A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + 0.05 * np.eye(2)), abs=1e-8)


def test_filterpy_gives_the_same_innovations(plant, noisy):
    from filterpy.kalman import KalmanFilter

    watch, u, y = noisy
    kf = KalmanFilter(dim_x=3, dim_z=2)
    kf.F, kf.H, kf.Q, kf.R = A, C, 0.01 * np.eye(3), 0.05 * np.eye(2)
    mine = watch.run(watch.initial(), u[:400], y[:400])[1]
    theirs = np.empty((400, 2))
    for k in range(400):
        kf.update((y[k] - D @ u[k])[:, None])
        theirs[k] = watch.whitener @ kf.y.ravel()
        kf.x = A @ kf.x + B @ u[k][:, None]
        kf.P = A @ kf.P @ A.T + kf.Q
    assert mine[200:] == pytest.approx(theirs[200:], abs=1e-6)


@pytest.mark.parametrize("fault", range(3))
def test_matched_filters_name_the_fault_that_arrived(plant, noisy, fault):
    watch, u, y = noisy
    bank = MatchedFilters({str(i): watch.response(i, 40) for i in range(3)})
    _, shifted, _ = driven(plant, n=4000, seed=9, fault=fault, at=2000)
    _, clean, _ = driven(plant, n=4000, seed=9)
    r = watch.run(watch.initial(), u, y + 1.2 * (shifted - clean))[1]
    matched = np.abs(bank.run(bank.initial(), np.zeros((4000, 0)), r)[1])
    named = matched[2030].argmax()
    assert named == fault
    assert matched[2030, fault] > 1.5 * matched[500:1900].max()


@pytest.mark.parametrize(
    "make",
    [lambda p: full_order(p, POLES), lambda p: functional(p, [0.2, 0.3]), lambda p: temporal(p, 3),
     lambda p: settled(p, np.eye(3), np.eye(2))],
    ids=["full", "functional", "parity", "kalman"],
)  # fmt: skip
def test_step_by_step_is_all_at_once_and_missing_readings_are_passed_over(plant, make):
    watch = make(plant)
    u, y, _ = driven(plant, n=60, x0=np.ones(3))
    y[20, 0] = np.nan
    whole = watch.run(watch.initial(), u, y)
    state, rows = watch.initial(), []
    for one, other in zip(u, y, strict=True):
        state, row = watch.step(state, one, other)
        rows.append(row)
    assert np.array(rows) == pytest.approx(whole[1], abs=1e-12, nan_ok=True)
    assert state == pytest.approx(whole[0], abs=1e-12, nan_ok=True)
    assert np.isnan(whole[1][20]).all()
    assert np.isfinite(np.delete(whole[1], 20, axis=0)).all()
