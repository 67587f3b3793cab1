"""Banks, decoupled residuals, envelopes and physical parameters, each against something that does not know them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from detector.generators import (
    Envelope,
    LinearPlant,
    all_but_one,
    evolve_neural,
    full_order,
    isolates,
    learn_dedicated,
    learn_envelope,
    learn_innovation_form,
    learn_neural,
    learn_physical,
    learn_score_bank,
    learn_takagi_sugeno,
    memberships,
    one_each,
    settled,
    structured,
    unknown_input,
)
from recordings import BadInput

A = np.array([[0.9, 0.2, 0.0], [-0.1, 0.8, 0.1], [0.0, 0.3, 0.7]])
B = np.array([[0.0], [0.5], [1.0]])
C = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
D = np.array([[0.1], [0.0]])
PLANT = LinearPlant(A, B, C, D, np.hstack([B, np.zeros((3, 2))]), np.hstack([D, np.eye(2)]))
"""Faults: actuator, first sensor, second sensor."""

QUICK = settings(max_examples=25, deadline=None, derandomize=True)


def driven(fault=None, n=200, seed=0):
    rng = np.random.default_rng(seed)
    u, f = rng.normal(size=(n, 1)), np.zeros((n, 3))
    if fault is not None:
        f[n // 2 :, fault] = 1.0
    return u, PLANT.simulate(u, np.ones(3), f)


def correlation(r, lag):
    r = r - r.mean(axis=0)
    return np.abs((r[lag:] * r[:-lag]).mean(axis=0) / r.var(axis=0)).max()


def coloured(n, seed):
    """A plant whose disturbance is not white at its output: an ARMAX process."""
    rng = np.random.default_rng(seed)
    u, e, y = rng.normal(size=(n, 1)), 0.1 * rng.normal(size=(n, 1)), np.zeros((n, 1))
    for k in range(2, n):
        y[k] = 1.5 * y[k - 1] - 0.7 * y[k - 2] + u[k - 1] + 0.5 * u[k - 2] + e[k] - 0.6 * e[k - 1]
    return u, y


def test_kalman_filter_of_a_learned_model_has_white_innovations_on_new_data():
    model = learn_innovation_form(*coloured(6000, 1))
    u, y = coloured(6000, 2)
    right = settled(model.plant, *model.covariances)
    wrong = settled(model.plant, *model.covariances[:2])  # the cross-covariance left out
    r, worse = (one.run(one.initial(), u - model.means[0], y - model.means[1])[1][100:] for one in (right, wrong))
    bound = 4 / np.sqrt(len(r))
    assert all(correlation(r, lag) < bound for lag in (1, 2, 3, 5, 10))
    assert correlation(worse, 1) > 2 * bound
    assert r.var() == pytest.approx(1.0, abs=0.1)
    assert right.gain == pytest.approx(model.K, abs=1e-6)


def test_an_innovation_form_needs_readings():
    with pytest.raises(BadInput, match="readings"):
        learn_innovation_form(np.zeros((50, 1)), np.zeros((50, 1)))


def test_the_generalised_set_is_blind_as_its_table_says():
    watch = structured(PLANT, all_but_one(3))
    table = watch.isolability()
    assert table.tolist() == (~np.eye(3, dtype=bool)).tolist()
    assert isolates(table) == "strongly"
    for fault in range(3):
        r = watch.run(watch.initial(), *driven(fault))[1]
        seen = np.abs(r[110:]).max(axis=0) > 1e-6
        assert seen.tolist() == table[:, fault].tolist()
        assert np.abs(r[10:100]).max() < 1e-9


def test_a_dedicated_set_needs_as_many_outputs_as_faults():
    with pytest.raises(BadInput, match="blind to 1, 2"):
        structured(PLANT, one_each(3))
    sensors = LinearPlant(A, B, C, D, np.zeros((3, 2)), np.eye(2))
    assert structured(sensors, one_each(2)).isolability().tolist() == np.eye(2, dtype=bool).tolist()


@QUICK
@given(st.integers(0, 10_000))
def test_an_unknown_input_moves_nothing(seed):
    rng = np.random.default_rng(seed)
    for through in (None, rng.normal(size=(2, 1))):
        into = np.array([[1.0], [0.0], [rng.uniform(0.5, 2.0)]])
        try:
            watch = unknown_input(PLANT, into, through)
        except BadInput:
            continue  # what it hides need not be detectable
        assert watch.holds(PLANT, 1e-7)
        both = LinearPlant(A, np.hstack([B, into]), C, np.hstack([D, np.zeros((2, 1)) if through is None else through]))
        u = rng.normal(size=(80, 2))
        r = watch.run(watch.initial(), u[:, :1], both.simulate(u))[1]
        assert np.abs(r).max() < 1e-8
        wrong = both.simulate(u) + np.array([0.0, 1.0])
        assert np.abs(watch.run(watch.initial(), u[:, :1], wrong)[1]).max() > 1e-3


def test_an_unknown_input_that_no_reading_shows_in_time_is_refused():
    with pytest.raises(BadInput, match="rank"):
        unknown_input(PLANT, np.array([[0.0], [1.0], [0.0]]))


@given(st.lists(st.integers(-5, 5), min_size=2, max_size=6, unique=True), st.floats(-10, 10))
def test_memberships_are_a_partition_of_unity(centres, place):
    h = memberships(np.array([place]), np.sort(np.array(centres, float)))
    assert h.sum() == pytest.approx(1.0)
    assert (h >= 0).all()


def curved(n, seed):
    rng = np.random.default_rng(seed)
    u, y = 0.9 * np.sin(2 * np.pi * np.arange(n)[:, None] / 300 + seed), np.zeros((n, 1))
    u += 0.1 * rng.normal(size=u.shape)
    for k in range(1, n):
        y[k] = (0.6 + 0.3 * u[k]) * y[k - 1] + np.tanh(2 * u[k]) + 0.01 * rng.normal()
    return u, y


def test_a_bank_of_one_local_model_is_its_observer_and_more_models_follow_a_curved_plant():
    u, y = curved(4000, 1)
    many, few = (learn_takagi_sugeno(u, y, models=n) for n in (7, 2))
    fresh = curved(4000, 2)
    errors = [np.std(one.run(one.initial(), *fresh)[1][100:] * one.deviation) for one in (many, few)]
    assert errors[0] < 0.6 * errors[1]
    alone = many.observers[3]
    joined = np.column_stack([fresh[0], np.ones(4000)])
    only = many.__class__((alone,), many.centres[3:4], 0, np.ones(1))
    assert only.run(only.initial(), *fresh)[1] == pytest.approx(alone.run(alone.initial(), joined, fresh[1])[1])
    assert full_order(LinearPlant(A, B, C), np.array([0.1, 0.2, 0.3])).width == (1, 2, 2)


def two_outputs(n, seed):
    rng = np.random.default_rng(seed)
    u, s = rng.uniform(-1, 1, (n, 1)), np.zeros(n)
    for k in range(1, n):
        s[k] = 0.6 * s[k - 1] + u[k, 0]
    return u, np.column_stack([s, np.tanh(s)]) + 0.02 * rng.normal(size=(n, 2))


@pytest.mark.parametrize("sensor", [0, 1])
def test_the_dedicated_scheme_names_the_sensor(sensor):
    watch = learn_dedicated(*two_outputs(3000, 1), depth=2)
    u, y = two_outputs(1000, 2)
    y[500:, sensor] += 1.0
    said = watch.suspects(watch.run(watch.initial(), u, y)[1], 5.0)
    assert (said[10:500] == -1).mean() > 0.99
    named = said[510:][said[510:] >= 0]
    assert len(named) > 50
    assert (named == sensor).mean() > 0.95


def test_the_search_finds_a_structure_that_is_no_worse_and_always_the_same():
    rng = np.random.default_rng(3)
    u, y = rng.uniform(-1, 1, (1500, 1)), np.zeros((1500, 1))
    for k in range(6, 1500):
        y[k] = 0.4 * y[k - 1] + np.tanh(2 * u[k - 6]) + 0.01 * rng.normal()
    one, other = (evolve_neural(u, y, generations=2, population=3, seed=4) for _ in range(2))
    assert (one.depth, one.hidden, one.error) == (other.depth, other.hidden, other.error)
    usual = learn_neural(u[:1000], y[:1000])
    missed = np.std(usual.run(usual.initial(), u[1000:], y[1000:])[1][10:] * usual.deviation) / np.std(y)
    assert one.depth >= 6  # what the plant remembers
    assert one.error < 0.5 * missed


@QUICK
@given(st.integers(0, 10_000), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_envelope_holds_every_behaviour_of_its_ranges(seed, where, lag):
    """A lag and a rising curve drawn from the ranges, both changing on the way, integrated by another program."""
    rng = np.random.default_rng(seed)
    knots = np.linspace(0.0, 1.0, 5)
    low = np.sort(rng.uniform(0.0, 1.0, 5))
    high = low + rng.uniform(0.1, 0.5)
    watch = Envelope(knots, low, high, (2.0, 6.0))
    u = rng.uniform(0.0, 1.0, 40)
    y, found = (low.min() + high.max()) / 2, []
    for k in range(40):
        share, T = (where + 0.3 * np.sin(k)) % 1.0, 2.0 + 4.0 * ((lag + 0.2 * k) % 1.0)
        goal = np.interp(u[k], knots, low + share * (high - low))
        y = solve_ivp(lambda t, x, goal=goal, T=T: (goal - x) / T, (0, 1), [y], rtol=1e-9, atol=1e-11).y[0, -1]
        found.append(y)
    r = watch.run(watch.initial(), u[:, None], np.array(found)[:, None])[1]
    assert np.abs(r).max() < 1e-7


def test_a_learned_envelope_holds_its_data_and_shows_a_valve_that_sticks():
    rng = np.random.default_rng(5)
    u, y = np.repeat(rng.uniform(0, 1, 100), 30), np.zeros(3000)
    for k in range(1, 3000):
        y[k] = y[k - 1] + 0.3 * (u[k] ** 2 - y[k - 1])
    y += 0.005 * rng.normal(size=3000)
    watch = learn_envelope(u, y)
    assert np.abs(watch.run(watch.initial(), u[:, None], y[:, None])[1]).max() < 1e-9
    stuck = np.where(np.arange(3000) > 1500, y[1500], y)
    r = np.abs(watch.run(watch.initial(), u[:, None], stuck[:, None])[1])
    assert r[1510:].max() > 0.5
    with pytest.raises(BadInput, match="vary"):
        learn_envelope(np.ones(200), np.ones(200))


def valve(spring, friction, seconds=40.0, mass=4.0, viscous=800.0):
    """m a + viscous v + fc sgn(v) + K x + F0 = u under a slow large motion, integrated by scipy."""
    step = 1e-3
    t = np.arange(0.0, seconds, step)
    x = 0.01 * np.sin(2 * np.pi * 0.4 * t) + 0.004 * np.sin(2 * np.pi * 1.1 * t + 1)
    v = 0.01 * 2 * np.pi * 0.4 * np.cos(2 * np.pi * 0.4 * t) + 0.004 * 2 * np.pi * 1.1 * np.cos(2 * np.pi * 1.1 * t + 1)
    a = -0.01 * (2 * np.pi * 0.4) ** 2 * np.sin(2 * np.pi * 0.4 * t)
    a -= 0.004 * (2 * np.pi * 1.1) ** 2 * np.sin(2 * np.pi * 1.1 * t + 1)
    half = t >= seconds / 2
    K, fc = np.where(half, spring[1], spring[0]), np.where(half, friction[1], friction[0])
    u = mass * a + viscous * v + fc * np.sign(v) + K * x + 500.0
    rng = np.random.default_rng(6)
    return u + rng.normal(size=len(t)), x + 1e-7 * rng.normal(size=len(t)), step


def test_physical_parameters_come_out_in_their_units_and_a_change_is_named():
    u, x, step = valve((6e4, 6e4), (150.0, 150.0))
    watch = learn_physical(u, x, step, corner=60.0)
    assert watch.estimation.usual == pytest.approx([4.0, 6e4, 800.0, 150.0, 500.0], rel=0.05)
    u, x, step = valve((6e4, 5e4), (150.0, 150.0))
    found = watch.parameters(watch.run(watch.initial(), u[:, None], x[:, None])[1])
    assert found[19_000, 1] == pytest.approx(6e4, rel=0.02)
    # Over 5 s the inertia, 1 N, is no more than the noise: the mass alone needs the whole run.
    assert found[-1, 1:] == pytest.approx([5e4, 800.0, 150.0, 500.0], rel=0.08)
    u, x, step = valve((6e4, 6e4), (150.0, 250.0))
    found = watch.parameters(watch.run(watch.initial(), u[:, None], x[:, None])[1])
    assert found[-1, [1, 3]] == pytest.approx([6e4, 250.0], rel=0.08)
    with pytest.raises(BadInput, match="slide"):
        learn_physical(np.zeros(500), np.zeros(500), 1e-3)


def process(n, seed):
    """A valve as a lag with play, a flow of equal percentage, and a pressure drop that wanders."""
    rng = np.random.default_rng(seed)
    cv = 0.5 + 0.3 * np.sin(2 * np.pi * np.arange(n) / 97) + 0.1 * np.sin(2 * np.pi * np.arange(n) / 23)
    p1, p2 = 1.0 + 0.02 * rng.normal(size=n), 0.4 + 0.02 * rng.normal(size=n)
    x = np.zeros(n)
    for k in range(1, n):
        x[k] = x[k - 1] + 0.5 * (cv[k] - x[k - 1])
    f = np.sqrt(p1 - p2) * np.exp(-2 * x)
    return np.column_stack([cv, p1, p2]), np.column_stack([x, f]) + 1e-3 * rng.normal(size=(n, 2))


def test_the_learned_score_bank_is_quiet_then_loud_and_may_be_cut_anywhere():
    bank = learn_score_bank(*process(4000, 1))
    u, y = process(1500, 2)
    y[1000:, 1] *= 1.05  # a flow that is 5 % too large
    whole = bank.run(bank.initial(), u, y)
    assert np.abs(whole[1][200:1000]).max() < 10
    assert np.abs(whole[1][1100:]).max() > 30
    state, parts = bank.initial(), []
    for part in (slice(0, 7), slice(7, 900), slice(900, 1500)):
        state, found = bank.run(state, u[part], y[part])
        parts.append(found)
    assert np.vstack(parts) == pytest.approx(whole[1], abs=1e-6)
