"""LuGre's observer in the loop, the parameter observer of the smoothed sign, and alpha(x, v) in all its forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from recordings import BadInput, BadParameter
from simulator.friction import (
    AlphaNetwork,
    Bells,
    LuGreParameters,
    ServoDesign,
    StribeckAlpha,
    TanhObserver,
    functional,
    functional_basis,
    functional_both,
    functional_both_basis,
    functional_remainder,
    simulate_servo,
    smoothed_friction,
    strictly_positive_real,
    taylor,
    taylor_value,
)

STEP = 1e-4
T = np.arange(0, 8, STEP)
MODEL = LuGreParameters(sigma0=1e5, sigma1=316.0, sigma2=20.0, fc=60.0, fs=90.0, vs=0.01)
POSITION = ServoDesign(mass=1.0, proportional=4000.0, derivative=400.0, correction=20.0)
VELOCITY = ServoDesign(mass=1.0, proportional=60.0, integral=900.0, correction=0.5)
REFERENCE = 0.01 * np.sin(2 * T)


def worst(run):
    return np.abs(run.error[len(run.t) // 2 :]).max()


def test_position_control_with_the_observer_has_no_error_left():
    assert strictly_positive_real(MODEL, POSITION)
    with_it = simulate_servo(MODEL, POSITION, REFERENCE, STEP)
    without = simulate_servo(MODEL, POSITION, REFERENCE, STEP, compensation=False)
    assert worst(without) > 5e-3
    assert worst(with_it) < 1e-3 * worst(without)
    late = slice(len(T) // 2, None)
    assert with_it.estimate[late] == pytest.approx(with_it.friction[late], abs=0.1)


def test_velocity_control_with_the_observer_has_no_error_left():
    reference = 0.02 * np.sin(2 * T)
    with_it = simulate_servo(MODEL, VELOCITY, reference, STEP, control="velocity")
    without = simulate_servo(MODEL, VELOCITY, reference, STEP, compensation=False, control="velocity")
    assert worst(without) > 1e-2
    assert worst(with_it) < 1e-3 * worst(without)


def test_a_wrong_model_leaves_an_error_that_is_smaller_than_without():
    believed = LuGreParameters(1e5, 316.0, 20.0, 50.0, 80.0, 0.01)
    wrong = simulate_servo(MODEL, POSITION, REFERENCE, STEP, believed=believed)
    without = simulate_servo(MODEL, POSITION, REFERENCE, STEP, compensation=False)
    assert 1e-3 * worst(without) < worst(wrong) < 0.3 * worst(without)


def test_the_condition_of_the_theorem_is_its_closed_form():
    # Re G > 0 at every frequency where sigma1 kd > sigma0 m, for H = kp + kd s.
    for derivative, wanted in ((300.0, False), (330.0, True)):
        assert strictly_positive_real(MODEL, ServoDesign(1.0, 4000.0, derivative)) is wanted


def test_the_body_solves_its_differential_equations():
    step, end = 1e-5, 0.4
    t = np.arange(0, end, step)
    run = simulate_servo(MODEL, POSITION, 0.01 * np.sin(2 * t) ** 2, step, compensation=False)

    def motion(s, y):
        x, v, z = y
        dz = v - abs(v) * MODEL.sigma0 * z / MODEL.level(v)
        error, pace = x - 0.01 * np.sin(2 * s) ** 2, v - 0.02 * np.sin(4 * s)
        push = 0.08 * np.cos(4 * s) - 4000 * error - 400 * pace
        return [v, push - MODEL.sigma0 * z - MODEL.sigma1 * dz - MODEL.sigma2 * v, dz]

    solved = solve_ivp(motion, (0, end), [0.0] * 3, t_eval=t[::500], method="LSODA", rtol=1e-9, atol=1e-12)
    assert run.x[::500] == pytest.approx(solved.y[0], abs=2e-3 * np.ptp(solved.y[0]))


def test_the_bristle_at_steady_speed_is_its_closed_form():
    v = np.array([-0.05, -1e-3, 1e-3, 0.05])
    assert MODEL.steady(v) == pytest.approx(np.sign(v) * MODEL.level(v) + 20 * v)
    assert MODEL.deflection(v) * MODEL.sigma0 == pytest.approx(np.sign(v) * MODEL.level(v))


def motion_of(n, step=1e-3):
    t = np.arange(n) * step
    return t, 0.05 * np.sin(3 * t) + 0.02 * np.sin(7.3 * t)


def test_the_parameters_of_the_smoothed_sign_are_observed():
    t, v = motion_of(15_000)
    u = 2.0 * np.gradient(v, t) + smoothed_friction(v, 60.0, 90.0, 0.01, 200.0, 3000.0)
    found = TanhObserver(2.0, 0.01, 3000.0).follow(t, u, v)
    assert found.parameters[-1] == pytest.approx([60.0, 30.0, 200.0], rel=0.03)
    assert np.abs(found.velocity - v)[-1000:].max() < 1e-3
    assert TanhObserver(2.0, 0.01).regressors(v)["fc"] == pytest.approx(np.tanh(3000.0 * v))  # 30 in units of vs
    one = TanhObserver(2.0, 0.01, 3000.0, unknown=("fc",), known={"excess": 30.0, "sigma2": 200.0}).follow(t, u, v)
    assert one.parameters[-1] == pytest.approx([60.0], rel=0.01)


def test_a_change_of_friction_is_seen():
    t, v = motion_of(20_000)
    fc = np.where(t > 10, 75.0, 60.0)
    u = np.gradient(v, t) + smoothed_friction(v, fc, fc + 30.0, 0.01, 200.0, 3000.0)
    found = TanhObserver(1.0, 0.01, 3000.0).follow(t, u, v)
    assert found.parameters[9_990, 0] == pytest.approx(60.0, rel=0.03)
    assert found.parameters[-1, 0] == pytest.approx(75.0, rel=0.03)


@pytest.mark.parametrize(
    ("velocity", "said"),
    [
        (lambda t: 0.1 + 0 * t, ""),
        (lambda t: 0 * t, "fc, excess, sigma2"),
        (lambda t: 0.5 + 1e-3 * t, "excess"),
    ],
)
def test_lost_observability_is_refused_before_it_runs(velocity, said):
    t = np.arange(100) * 0.01
    with pytest.raises(BadInput, match=f"observability is lost.*does not tell {said}"):
        TanhObserver(1.0, 0.01, 3000.0).follow(t, 0 * t, velocity(t))


ALPHA = StribeckAlpha.of(1e5, 60.0, 90.0, 0.01)
V = np.linspace(0.0, 0.1, 200)


def test_alpha_lies_between_its_bounds():
    assert ALPHA(0.0) == pytest.approx(1e5 / 90)
    assert ALPHA(10.0) == pytest.approx(1e5 / 60)
    assert ((ALPHA(V) >= 1e5 / 90) & (ALPHA(V) <= 1e5 / 60)).all()


def test_taylor_weights_are_the_derivatives():
    # d alpha/dw = c0 c1 e/(1 + c1 e)^2 at w = 0, by hand; the others by a polynomial through values near 0.
    W, by_speed = taylor(ALPHA, 4)
    c0, c1 = ALPHA.c0, ALPHA.c1
    assert W[:2] == pytest.approx([c0 / (1 + c1), c0 * c1 / (1 + c1) ** 2])
    w = 0.2 * np.cos(np.pi * (np.arange(25) + 0.5) / 25)
    values = c0 / (1 + c1 * np.exp(-w))
    assert pytest.approx(np.polynomial.polynomial.polyfit(w, values, 12)[:5], rel=1e-6) == W
    assert by_speed[2] == pytest.approx(W[2] / ALPHA.c2**2)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(0.05, 0.95), st.floats(0.3, 0.85))
def test_the_taylor_series_converges_up_to_its_radius_and_not_beyond(excess, share):
    alpha = StribeckAlpha(1000.0, excess, 1e-4)

    def off(order, v):
        return abs(float(taylor_value(alpha, order, v) / alpha(v)) - 1)

    assert off(60, share * alpha.converges_below) < 1e-3
    assert off(60, 1.3 * alpha.converges_below) > 10


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(0.05, 0.95), st.floats(0.1, 0.9), st.integers(0, 8))
def test_the_functional_expansion_leaves_its_remainder_at_any_speed(excess, nominal, order):
    alpha = StribeckAlpha(1000.0, excess, 1e-4)
    found = functional_basis(nominal, alpha.c2, order, V) @ functional(alpha, nominal, order)
    left = alpha(V) - found
    assert left == pytest.approx(functional_remainder(alpha, nominal, order, V), abs=1e-9)
    assert np.abs(left).max() <= alpha.c0 * abs(excess - nominal) ** (order + 1) + 1e-9  # the bound after (2.31)


@pytest.mark.parametrize("order", [0, 1, 2, 4])
def test_the_expansion_in_both_parameters_is_of_its_order(order):
    """Halving the way from the nominal values divides what is left by 2^(order + 1), at every speed on the way."""
    nominal = (0.5, 1e-4)

    def left(way):
        alpha = StribeckAlpha(1000.0, 0.5 + 0.3 * way, 1 / (1e4 - 3e3 * way))
        found = functional_both_basis(nominal, order, V) @ functional_both(alpha, nominal, order)
        return np.abs(alpha(V) - found).max()

    assert left(0.02) / left(0.01) == pytest.approx(2 ** (order + 1), rel=0.1)
    assert left(1.0) < 1000.0 * 0.3 ** (order + 1)


def test_the_expansion_in_both_is_that_in_one_where_the_other_is_known():
    alpha = StribeckAlpha(1000.0, 0.7, 1e-4)
    both = functional_both_basis((0.5, 1e-4), 3, V) @ functional_both(alpha, (0.5, 1e-4), 3)
    assert both == pytest.approx(functional_basis(0.5, 1e-4, 3, V) @ functional(alpha, 0.5, 3))


BELLS = Bells(np.column_stack([np.zeros(13), np.linspace(-0.06, 0.06, 13)]), (np.inf, 0.012))
AT = np.linspace(-0.04, 0.04, 81)
WEIGHTS = np.linalg.lstsq(BELLS(0.0, AT), ALPHA(AT), rcond=None)[0]
TIME = np.arange(8000) * 2e-3
MOVED = 0.01 * np.sin(3 * TIME) + 0.006 * np.sin(1.3 * TIME)


def network(weights):
    return AlphaNetwork(BELLS, weights, 1e5, 100.0, 50.0, bounds=(100.0, 5000.0))


def test_a_network_is_lugre_where_it_is_right():
    t = np.arange(0, 2, 5e-4)
    x, v = 0.01 * np.sin(3 * t), 0.03 * np.cos(3 * t)

    def rate(s, z):
        speed = 0.03 * np.cos(3 * s)
        return speed - ALPHA(speed) * abs(speed) * z

    z = solve_ivp(rate, (0, 2), [0.0], t_eval=t, rtol=1e-9, atol=1e-12, max_step=1e-3).y[0]
    force = 1e5 * z + 100 * (v - ALPHA(v) * np.abs(v) * z) + 50 * v
    assert network(WEIGHTS).follow(t, x)[1:] == pytest.approx(force[1:], abs=1.5)
    assert BELLS(0.0, AT) @ WEIGHTS == pytest.approx(ALPHA(AT), rel=0.01)


def test_the_weights_are_learned_on_line():
    force, net = network(WEIGHTS).follow(TIME, MOVED), network(np.full(13, 800.0))
    first = np.std(net.follow(TIME, MOVED) - force)
    for _ in range(4):
        errors = net.learn(TIME, MOVED, force)
    assert np.std(errors) < 0.01 * first
    assert net.alpha(0.0, AT) == pytest.approx(ALPHA(AT), rel=0.15)


def test_alpha_may_depend_on_the_position():
    spots = Bells(np.array([[p, v] for p in (-0.01, 0.0, 0.01) for v in (-0.03, 0.0, 0.03)]), (0.006, 0.02))
    W = np.array([500.0, 700, 500, 300, 500, 300, 500, 700, 500])
    true = AlphaNetwork(spots, W, 1e5, 100.0, 50.0)
    force, net = true.follow(TIME, MOVED), AlphaNetwork(spots, np.full(9, 500.0), 1e5, 100.0, 50.0)
    first = np.std(net.follow(TIME, MOVED) - force)
    for _ in range(3):
        net.learn(TIME, MOVED, force, gain=0.2)
    assert np.std(net.follow(TIME, MOVED) - force) < 0.3 * first


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: LuGreParameters(0.0, 1, 1, 1, 1, 1), "sigma0 0"),
        (lambda: simulate_servo(MODEL, ServoDesign(0.0, 1.0), REFERENCE, STEP), "mass 0"),
        (lambda: simulate_servo(MODEL, POSITION, REFERENCE, 0.1), "step 0"),
        (lambda: simulate_servo(MODEL, POSITION, REFERENCE[:1], STEP), "reference"),
        (lambda: TanhObserver(1.0, -1.0, 1.0), "vs -1"),
        (lambda: TanhObserver(1.0, 1.0, 1.0, unknown=("fc",)), "unknown fc"),
        (lambda: TanhObserver(1.0, 1.0, 1.0).follow([0.0], [0.0], [0.0]), "time"),
        (lambda: StribeckAlpha(1.0, -1.0, 1.0), "c1 -1"),
        (lambda: StribeckAlpha.of(1.0, 0.0, 1.0, 1.0), "fc 0"),
        (lambda: taylor(ALPHA, -1), "order -1"),
        (lambda: functional_basis(-1.0, 1.0, 1, 0.0), "nominal -1"),
        (lambda: functional_basis(0.5, 0.0, 1, 0.0), "c2 0"),
        (lambda: Bells(np.zeros(3), (1.0, 1.0)), "centres"),
        (lambda: Bells(np.zeros((3, 2)), (1.0, 0.0)), "widths"),
        (lambda: network([1.0]), "weights"),
        (lambda: AlphaNetwork(BELLS, WEIGHTS, 0.0), "sigma0 0"),
        (lambda: AlphaNetwork(BELLS, WEIGHTS, 1.0, bounds=(2.0, 1.0)), "bounds"),
        (lambda: network(WEIGHTS).follow([0, 0], [0.0, 1.0]), "time"),
        (lambda: network(WEIGHTS).learn(TIME, MOVED, MOVED[:3]), "force"),
        (lambda: network(WEIGHTS).learn(TIME, MOVED, MOVED, gain=2.0), "gain 2"),
    ],
)
def test_what_cannot_be_is_refused(ask, said):
    with pytest.raises(BadParameter, match=said):
        ask()
