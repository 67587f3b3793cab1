"""Chua and Stromsmoe's model: its six properties, its construction from a loop, and its improved form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from recordings import BadParameter
from simulator.hysteresis import ChuaStromsmoe

T = np.linspace(0, 2 * np.pi, 401)


def f(y):
    return y + 0.5 * y**3


def h(y):
    return 2 + np.tanh(y)


def g(d):
    return np.sinh(d)


MODEL = ChuaStromsmoe(f, g, h)
INPUT = 2 * np.cos(T)
PERIODIC = MODEL.periodic(T, INPUT)


@settings(max_examples=8, deadline=None, derandomize=True)
@given(st.floats(-3, 3), st.lists(st.floats(-2, 2), min_size=4, max_size=8))
def test_property_1_solutions_are_bounded_and_one(start, inputs):
    t = np.arange(len(inputs)) * 0.7
    y, near = MODEL.follow(t, inputs, start), MODEL.follow(t, inputs, start + 1e-3)
    ends = [float(np.roots([0.5, 0, 1, -x])[np.isreal(np.roots([0.5, 0, 1, -x]))][0].real) for x in inputs]
    assert min(*ends, start) - 1e-6 <= y.min() <= y.max() <= max(*ends, start) + 1e-6
    gap = near - y  # of two solutions none overtakes the other
    assert (gap > -1e-5).all()


def test_property_2_there_is_one_periodic_solution():
    assert PERIODIC[-1] == pytest.approx(PERIODIC[0], abs=1e-7)
    starts = np.linspace(-2, 2, 9)
    ahead = [MODEL.follow(T, INPUT, y)[-1] - y for y in starts]
    assert (np.diff(ahead) < 0).all()


@pytest.mark.parametrize("start", [-3.0, 0.0, 3.0])
def test_property_3_all_others_approach_it(start):
    y = start
    for _ in range(3):
        y = MODEL.follow(T, INPUT, y)[-1]
    assert y == pytest.approx(PERIODIC[0], abs=1e-5)


def test_property_4_it_has_one_maximum_and_one_minimum():
    turned = np.flatnonzero(np.diff(np.sign(np.diff(np.concatenate([PERIODIC[:-1], PERIODIC[:2]])))))
    assert len(turned) == 2


def halves(x, y, n=50):
    """x on the branches of a loop where y rises and falls, at the same values of y."""
    top, bottom = np.argmax(y), np.argmin(y)
    around = np.roll(np.arange(len(y) - 1), -bottom)
    rising = around[: (top - bottom) % (len(y) - 1) + 1]
    falling = around[(top - bottom) % (len(y) - 1) :]
    at = np.linspace(y[bottom], y[top], n + 2)[1:-1]
    return np.interp(at, y[rising], x[rising]), np.interp(at, y[falling][::-1], x[falling][::-1])


def test_property_5_the_loop_does_not_cross_itself():
    rising, falling = halves(INPUT, PERIODIC)
    assert (rising > falling).all()


def area(x, y):
    return abs(np.sum((x[1:] + x[:-1]) / 2 * np.diff(y)))


def test_property_6_the_loop_widens_with_frequency():
    y = np.cos(T)
    areas = [area(MODEL.input_of(y, -pace * np.sin(T), np.arcsinh), y) for pace in (0.1, 0.5, 1.0, 2.0)]
    assert (np.diff(areas) > 0).all()
    straight = ChuaStromsmoe(f, lambda d: 3 * d)
    closed = np.pi * 2.0 / 3.0  # pi A^2 omega / (k h)
    assert area(straight.input_of(y, -2 * np.sin(T), lambda r: r / 3), y) == pytest.approx(closed, rel=1e-3)


def test_it_solves_its_differential_equation():
    x = CubicSpline([0, 1, 2, 3, 4], [0.0, 1.5, -2.0, 0.5, 1.0])
    t = np.linspace(0, 4, 4001)
    solved = solve_ivp(lambda s, y: h(y) * g(x(s) - f(y)), (0, 4), [0.2], t_eval=t[::100], rtol=1e-10, atol=1e-12)
    assert MODEL.follow(t, x(t), 0.2)[::100] == pytest.approx(solved.y[0], abs=2e-5)


def test_the_equation_is_that_of_a_lag_where_it_is_linear():
    t = np.linspace(0, 3, 301)
    y = ChuaStromsmoe(lambda y: y, lambda d: 2 * d).follow(t, np.ones_like(t), 0.0)
    assert y == pytest.approx(-np.expm1(-2 * t), abs=1e-6)


@pytest.mark.parametrize("chosen", [g, lambda d: 3 * d, lambda d: d + d**3])
def test_a_measured_cosine_loop_is_reproduced_whatever_g_is(chosen):
    t = np.linspace(0, 4.0, 801)
    angle = np.pi / 2 * t + 0.4
    y = 0.3 + 0.8 * np.cos(angle)
    x = MODEL.input_of(y, -0.8 * np.pi / 2 * np.sin(angle), np.arcsinh)
    made = ChuaStromsmoe.of_cosine_loop(t, x, y, chosen)
    assert made.periodic(t, x) == pytest.approx(y, abs=0.01)


def test_f_and_h_are_found_where_g_is_right():
    t = np.linspace(0, 4.0, 2001)
    y = 0.8 * np.cos(np.pi / 2 * t)
    x = MODEL.input_of(y, -0.8 * np.pi / 2 * np.sin(np.pi / 2 * t), np.arcsinh)
    made = ChuaStromsmoe.of_cosine_loop(t, x, y, g)
    at = np.linspace(-0.7, 0.7, 15)
    assert made.restoring(at) == pytest.approx(f(at), abs=1e-3)
    assert made.weighting(at) == pytest.approx(h(at), rel=1e-2)


def test_the_improved_form_has_a_loop_at_rest_and_can_narrow():
    def loop(model, pace):
        t = T / pace
        x = 2 * np.cos(T)
        y = model.periodic(t, x)
        return area(x, y)

    classical = [loop(MODEL, pace) for pace in (0.01, 0.1, 1.0)]
    assert classical[0] < 0.1 * classical[2]
    even = ChuaStromsmoe(f, g, h, rate=np.abs)
    assert loop(even, 0.01) == pytest.approx(loop(even, 10.0), rel=1e-3)
    held = ChuaStromsmoe(f, g, h, rate=lambda v: np.minimum(abs(v), 3.0))
    slow, fast = loop(held, 0.1), loop(held, 1000.0)
    assert slow == pytest.approx(loop(even, 0.1), rel=1e-3)
    assert fast < 0.5 * slow
    assert even.follow([0, 1, 2], [1.0, 1.0, 1.0], 0.1) == pytest.approx([0.1] * 3)  # at rest any output stays


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"input": INPUT[::-1]}, "not right of the other"),
        ({"output": np.cos(2 * T)}, "off a cosine"),
        ({"output": np.cos(T)[:-5]}, "output"),
        ({"dissipation": lambda d: d**2}, "g is not odd"),
        ({"input": -3 * np.cos(T) - np.sin(T)}, "not monotone"),
    ],
)
def test_what_is_no_loop_is_refused(change, said):
    given = {"time": T, "input": np.cos(T) - np.sin(T), "output": np.cos(T)}
    with pytest.raises(BadParameter, match=said):
        ChuaStromsmoe.of_cosine_loop(**{**given, **change})


def test_what_is_no_model_is_refused():
    with pytest.raises(BadParameter, match="f does not rise"):
        ChuaStromsmoe(lambda y: y + 3 * np.sin(y)).follow([0, 1], [-9.0, 9.0], 0.0)
    with pytest.raises(BadParameter, match="g does not rise"):
        ChuaStromsmoe(f, np.sin).follow([0, 1], [-9.0, 9.0], 0.0)
    with pytest.raises(BadParameter, match="w is negative"):
        ChuaStromsmoe(f, g, h, rate=np.sign).follow([0, 1], [1.0, 0.0], 0.0)
    with pytest.raises(BadParameter, match="f never has"):
        ChuaStromsmoe(np.tanh).follow([0, 1], [0.0, 2.0], 0.0)
    with pytest.raises(BadParameter, match="h is not positive"):
        ChuaStromsmoe(f, g, lambda y: y).follow([0, 1], [0.0, 1.0], 0.0)
    with pytest.raises(BadParameter, match="a whole period"):
        MODEL.periodic([0, 1], [0.0, 1.0])
    with pytest.raises(BadParameter, match="time"):
        MODEL.follow([0, 0], [0.0, 1.0], 0.0)
