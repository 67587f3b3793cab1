"""Operators of hysteresis and backlash: the properties that define them, and known areas and limits."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from recordings import BadParameter
from simulator.backlash import AdaptiveBacklashInverse, Backlash, BacklashInverse, GeneralisedPlay, SmoothBacklash
from simulator.hysteresis import (
    AdaptiveQuadrilateralInverse,
    MaxwellSlip,
    Preisach,
    Quadrilateral,
    QuadrilateralInverse,
)

LINES = {"mt": 0.2, "ct": 1.0, "mb": 0.3, "cb": -1.2, "mr": 2.0, "cr": 1.0, "ml": 1.6, "cl": -1.1}


def even(a, b):
    """Half the first-order curves of a weight of 1: the area of the triangle."""
    return (a - b) ** 2 / 2


def uneven(a, b):
    """Those of a weight of alpha^2 + 1."""
    return (a**4 - b**4) / 4 - b * (a**3 - b**3) / 3 + (a - b) ** 2 / 2


def route(points, n=200):
    """A path through turning points in small one-way moves."""
    return np.concatenate([np.linspace(a, b, n)[1:] for a, b in itertools.pairwise(points)])


def follow(operator, path):
    return np.array([operator.update(float(v)) for v in path])


def area(x, y):
    """Area of a closed loop."""
    return abs(np.sum((y + np.roll(y, 1)) / 2 * (x - np.roll(x, 1))))


@pytest.mark.parametrize(("curves", "weight"), [(even, lambda a: 0 * a + 1), (uneven, lambda a: a**2 + 1)])
def test_preisach_is_a_sum_of_relays(curves, weight):
    n = 400
    edges = (np.arange(n) + 0.5) / n
    alpha, beta = np.meshgrid(edges, edges, indexing="ij")
    inside = alpha >= beta
    mu = np.where(inside, weight(alpha), 0.0) / n**2 * np.where(alpha == beta, 0.5, 1.0)
    relay, model = -np.ones_like(alpha), Preisach(curves, 0.0, 1.0)
    for u in np.random.default_rng(1).uniform(0, 1, 60):
        relay[alpha <= u], relay[beta >= u] = 1.0, -1.0
        assert model.update(u) == pytest.approx((mu * relay).sum(), abs=0.02)


def test_preisach_wipes_out():
    long, short = Preisach(uneven, 0.0, 1.0), Preisach(uneven, 0.0, 1.0)
    for u in (0.9, 0.2, 0.7, 0.3, 0.6, 0.4, 0.75):
        long.update(u)
    for u in (0.9, 0.2, 0.75):
        short.update(u)
    assert long.memory == short.memory == (0.0, 0.9, 0.2)
    path = route([0.75, 0.1, 0.95])
    assert follow(long, path) == pytest.approx(follow(short, path), abs=1e-15)
    assert long.memory == (0.0,)


def test_preisach_loops_between_the_same_inputs_are_congruent():
    def loop(history):
        model = Preisach(uneven, 0.0, 1.0)
        follow(model, np.array([*history, 0.3]))
        return follow(model, route([0.3, 0.6, 0.3]))

    first, second = loop([0.9]), loop([1.0, 0.05, 0.7])
    assert abs(first[0] - second[0]) > 0.05
    assert first - first[0] == pytest.approx(second - second[0], abs=1e-14)


def test_preisach_saturates_symmetrically_and_ignores_pauses():
    model = Preisach(even, 0.0, 1.0)
    assert (model.update(5.0), model.update(5.0), model.update(-5.0)) == (0.5, 0.5, -0.5)
    with pytest.raises(ValueError, match="low is less than high"):
        Preisach(even, 1.0, 1.0)


def test_the_area_of_a_maxwell_loop_is_known():
    k, level = np.array([4.0, 2.0, 1.0]), np.array([1.0, 1.0, 1.0])
    stack, half = MaxwellSlip(k, level), 2.0
    follow(stack, route([0, half, -half]))
    path = route([-half, half, -half], 4001)
    expected = (4 * level * (half - level / k)).sum()
    assert area(path, follow(stack, path)) == pytest.approx(expected, rel=1e-3)


def test_maxwell_slip_remembers_more_than_its_force():
    def after(history):
        stack = MaxwellSlip([4.0, 2.0, 1.0], [1.0, 1.0, 1.0])
        force = follow(stack, route(history))[-1]
        return force, follow(stack, np.linspace(history[-1], history[-1] + 1.5, 200)) - force

    # The same force, reached in two ways, goes on in two ways: memory is not local.
    (virgin, on), (turned, other) = after([0, 0.2]), after([0, 1.0, 0.3, 0.3 + 0.1])
    _, back = after([0, 1.0, 0.3])
    assert virgin == pytest.approx(1.4)
    assert abs(on - other).max() > 0.1
    assert abs(on - back).max() > 0.1
    assert turned != virgin


@pytest.mark.parametrize(
    ("stiffness", "said"),
    [([1.0, -1.0], "stiffness"), ([1.0, np.inf], "stiffness"), ([1.0], "level"), ([[1.0, 1.0]], "level")],
)
def test_maxwell_slip_refuses_what_is_no_element(stiffness, said):
    with pytest.raises(BadParameter, match=said):
        MaxwellSlip(stiffness, [1.0, 1.0])


def test_the_quadrilateral_runs_along_its_lines():
    loop = Quadrilateral(**LINES)
    upper_left, lower_right, upper_right, lower_left = loop.lines.corners
    path = route([0, 4, -4])
    follow(loop, path)
    down_up = route([4, -4, 4], 4001)
    follow(loop, np.linspace(-4, 4, 4001))
    u = follow(loop, down_up)
    down, up = u[:4000], u[4000:]
    v_down, v_up = down_up[:4000], down_up[4000:]
    top = v_down > upper_left + 1e-2
    assert down[top] == pytest.approx(LINES["mt"] * v_down[top] + LINES["ct"])
    left = (v_down < upper_left - 1e-2) & (v_down > lower_left + 1e-2)
    assert down[left] == pytest.approx(LINES["ml"] * (v_down[left] - LINES["cl"]))
    bottom = v_up < lower_right - 1e-2
    assert up[bottom] == pytest.approx(LINES["mb"] * v_up[bottom] + LINES["cb"])
    right = (v_up > lower_right + 1e-2) & (v_up < upper_right - 1e-2)
    assert up[right] == pytest.approx(LINES["mr"] * (v_up[right] - LINES["cr"]))


def test_the_inverse_quadrilateral_inverts():
    loop, inverse = Quadrilateral(**LINES), QuadrilateralInverse(**LINES)
    wanted = route([0, 1.5, -1.6, 0.4, -0.3, 0.2, 1.8, -2.0])
    got = follow(loop, follow(inverse, wanted))
    settled = np.argmax(wanted > 1.4)
    assert got[settled:] == pytest.approx(wanted[settled:], abs=1e-12)


@pytest.mark.parametrize("start", [-0.5, 0.0, 0.3])
def test_backlash_answers_a_sine_as_published(start):
    # Figure 2.2: m = 1, cr = 0.5, cl = -0.5 and three initial values; only -0.5 starts without a transient.
    v = 1.5 * np.sin(np.linspace(0, 4 * np.pi, 4001))
    u = follow(Backlash(1.0, -0.5, 0.5, start), v)
    first, second = u[:2001], u[2000:]
    assert second.max() == pytest.approx(1.0, abs=1e-6)
    assert second.min() == pytest.approx(-1.0, abs=1e-6)
    transient = abs(first[1:501] - (v[1:501] - 0.5)).max()
    assert (transient < 1e-9) == (start == -0.5)
    assert np.argmax(second) > np.argmax(v[2000:]) - 1
    assert second[500] == pytest.approx(1.0, abs=1e-6)
    assert np.ptp(second[500:600]) == pytest.approx(0.0, abs=1e-6)  # the peak is chopped


def test_the_inverse_backlash_inverts():
    gap = {"slope": 0.8, "left": -0.3, "right": 0.4}
    wanted = route([0, 1.0, 0.2, 0.9, -1.0, 0.5])
    got = follow(Backlash(**gap), follow(BacklashInverse(**gap), wanted))
    assert got == pytest.approx(wanted, abs=1e-12)


def test_smooth_backlash_solves_its_differential_equation_and_settles():
    alpha, c, b1 = 1.0, 3.1635, 0.345
    v = 6.5 * np.sin(np.linspace(0, 6.6, 200_001))
    smooth = follow(SmoothBacklash(alpha, c, b1), v)
    dv, w = np.diff(v), smooth[:-1]
    euler = alpha * abs(dv) * (c * v[:-1] - w) + b1 * dv
    assert np.diff(smooth) == pytest.approx(euler, abs=2e-6)
    settled = SmoothBacklash(alpha, c, b1)
    assert settled.update(50.0) - c * 50.0 == pytest.approx(-(c - b1) / alpha)
    assert settled.update(-50.0) + c * 50.0 == pytest.approx((c - b1) / alpha)


def test_operators_do_not_count_steps():
    makers = (
        lambda: Backlash(), lambda: SmoothBacklash(2.0, 1.0, 0.3), lambda: Quadrilateral(**LINES),
        lambda: Preisach(even, -2.0, 2.0), lambda: MaxwellSlip([3.0, 1.0], [1.0, 1.0]), lambda: BacklashInverse(),
    )  # fmt: skip
    turns = [0.0, 1.3, -0.8, 0.9, 0.1, 1.7, -1.9]
    for make in makers:
        coarse, fine = follow(make(), turns[1:]), follow(make(), route(turns, 51))
        assert coarse == pytest.approx(fine[49::50], abs=1e-12)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Backlash(left=0.5, right=0.5), "right 0.5: it is not above the left crossing, 0.5; c_r > c_l"),
        (lambda: BacklashInverse(left=0.5, right=-0.5), "right -0.5: .*c_r > c_l"),
        (lambda: AdaptiveBacklashInverse(left=0.5, right=0.5), "right 0.5: .*c_r > c_l"),
        (lambda: Backlash(right=np.inf), "right inf"),
        (lambda: Backlash(left=np.nan), "right 0.5: .*nan"),
        (lambda: BacklashInverse(slope=-1.0), "slope -1: .*m > 0"),
        (lambda: SmoothBacklash(1.0, 1.0, 1.0), "c 1: it is not above b1, 1; c > B1"),
        (lambda: SmoothBacklash(0.0, 1.0, 0.5), "alpha 0"),
        (lambda: Quadrilateral(**{**LINES, "mr": 0.1}), "mr 0.1: the side is not steeper"),
        (lambda: Quadrilateral(**{**LINES, "mb": 0.0}), "mb 0: the line does not rise"),
        (lambda: Quadrilateral(**{**LINES, "cr": -2.0}), "cr -2: .*as where c_r > c_l"),
        (lambda: QuadrilateralInverse(**{**LINES, "ct": -3.0}), "ct -3: .*as where c_t > c_b"),
        (lambda: AdaptiveQuadrilateralInverse(**{**LINES, "cr": -2.0}), "cr -2"),
        (lambda: GeneralisedPlay(lambda v: v, lambda v: 2 * v).update(-1.0), "push: it is -1 at -1, above pull, -2"),
    ],
)
def test_what_is_no_operator_is_refused_by_name_and_condition(make, said):
    with pytest.raises(BadParameter, match=said):
        make()
