"""The Leuven model: loops that close at every size, its closed form, its differential equation, and no drift."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from recordings import BadParameter
from simulator.friction import LeuvenFriction
from simulator.hysteresis import LeuvenStack

LEVEL, STIFFNESS = 100.0, 2e6
SCALE = LEVEL / STIFFNESS


def straight(z):
    return STIFFNESS * z


def bent(z):
    return 1.5 * LEVEL * np.tanh(z / SCALE)


def route(points, n=200):
    """A path through turning points in small one-way moves."""
    return np.concatenate([np.linspace(a, b, n)[1:] for a, b in itertools.pairwise(points)])


def test_the_default_is_the_exponential_of_its_closed_form():
    # n = 1 and a straight curve: dF/dx = k (1 - F/S), so V = S (1 - exp(-k x/S)), and branches are V doubled.
    x = np.linspace(0, 5e-4, 400)
    assert LeuvenStack(straight, LEVEL).follow(x) == pytest.approx(-LEVEL * np.expm1(-x / SCALE), abs=2e-4)
    stack = LeuvenStack(straight, LEVEL)
    top = stack.update(5e-5)
    down = np.linspace(5e-5, 1e-5, 50)
    expected = top + 2 * LEVEL * np.expm1(-(5e-5 - down) / 2 / SCALE)
    assert stack.follow(down) == pytest.approx(expected, abs=4e-4)


@pytest.mark.parametrize("curve", [straight, bent])
@pytest.mark.parametrize("n", [1.0, 2.0, 20.0])
def test_the_virgin_curve_solves_its_differential_equation(curve, n):
    x = np.linspace(0, 4 * SCALE, 60)
    solved = solve_ivp(
        lambda _, z: 1 - (curve(z) / LEVEL) ** n,
        (0, x[-1]),
        [0.0],
        t_eval=x,
        rtol=1e-10,
        atol=1e-14,
        max_step=SCALE / 99,
    )
    assert LeuvenStack(curve, LEVEL, n).follow(x) == pytest.approx(curve(solved.y[0]), abs=1e-3 * LEVEL)


@pytest.mark.parametrize("half", SCALE * np.array([1e-3, 0.1, 0.5, 1.0, 2.0, 6.0, 50.0]))
@pytest.mark.parametrize("middle", SCALE * np.array([0.0, 0.7, -3.0]))
def test_loops_close_at_every_size_and_stay(half, middle):
    stack = LeuvenStack(straight, LEVEL)
    stack.update(middle)
    tops, bottoms = [stack.update(middle + half)], []
    for _ in range(5):
        bottoms.append(stack.update(middle - half))
        tops.append(stack.update(middle + half))
    # An inner loop is closed at once; one that is wider than all before it closes from its second round on.
    assert tops[1:] == pytest.approx([tops[1]] * 5, abs=1e-9)
    assert bottoms[1:] == pytest.approx([bottoms[1]] * 4, abs=1e-9)
    assert stack.memory <= 2


def test_the_printed_slip_does_not_close():
    # (2.34) with S - F_b as printed, F_d = k z, n = 1: each branch is F_b + (S - F_b)(1 - exp(-k d/S')), see errata.
    def branch(base, way, d):
        room = way * LEVEL - base
        return base + room * -np.expm1(-STIFFNESS * d / abs(room))

    tops = [branch(0.0, 1, 1e-4)]
    for _ in range(4):
        tops.append(branch(branch(tops[-1], -1, 5e-5), 1, 5e-5))
    assert (np.diff(tops) < -1.0).all()
    stack = LeuvenStack(straight, LEVEL)
    found = [stack.update(x) for x in (1e-4, 5e-5) * 4][::2]
    assert found == pytest.approx([found[0]] * 4, abs=1e-9)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.lists(st.floats(-6.0, 6.0), min_size=1, max_size=12), st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_an_inner_loop_leaves_nothing_behind(turns, down, up):
    plain, looped = LeuvenStack(bent, LEVEL, 2.0), LeuvenStack(bent, LEVEL, 2.0)
    path = SCALE * np.array(turns)
    before = looped.follow(path)
    plain.follow(path)
    assert abs(before).max() <= LEVEL * (1 + 1e-12)
    last, start = path[-1], path[-2] if len(path) > 1 else 0.0
    inner = last + down * (start - last)
    back = inner + up * (last - inner)
    looped.follow([inner, back, inner, last])
    on = last + np.linspace(0, 8, 30) * (last - start)
    assert looped.follow(on) == pytest.approx(plain.follow(on), abs=1e-7)
    assert looped.memory == plain.memory


def test_it_does_not_count_steps_and_forgets_when_it_slides():
    turns = SCALE * np.array([0.0, 1.3, -0.8, 0.9, 0.1, 1.7, -1.2])
    coarse, fine = LeuvenStack(bent, LEVEL), LeuvenStack(bent, LEVEL)
    assert coarse.follow(turns[1:]) == pytest.approx(fine.follow(route(turns, 51))[49::50], abs=1e-9)
    assert coarse.memory == fine.memory > 0
    assert coarse.update(100 * SCALE) == pytest.approx(LEVEL)
    assert coarse.memory == 0


def creeping(reach, span):
    """How far a bristle or a stack has crept after cycles of the force between two values; reach(x) is the force."""
    x = 0.0
    places = []
    for wanted in (*span[::-1], *span[::-1] * 5):
        x = brentq(lambda x, wanted=wanted: reach(x) - wanted, x - 3 * SCALE, x + 3 * SCALE, xtol=1e-15)
        reach(x, True)
        places.append(x)
    return places[-2] - places[0]


def test_it_does_not_drift_where_lugre_does():
    turns = [0.0]

    def stack(x, take=False):
        found = LeuvenStack(straight, LEVEL).follow([*turns[1:], x])[-1]
        if take:
            turns.append(x)
        return found

    state = [0.0, 0.0]

    def bristle(x, take=False):
        way = np.sign(x - state[0])  # dF/dx = k (1 - way F/S)
        found = way * LEVEL + (state[1] - way * LEVEL) * np.exp(-abs(x - state[0]) / SCALE)
        if take:
            state[:] = x, found
        return found

    span = (20.0, 60.0)
    assert abs(creeping(stack, span)) < 1e-10
    cycle = SCALE * (np.log(80 / 40) - np.log(160 / 120))
    assert creeping(bristle, span) == pytest.approx(5 * cycle, rel=1e-6)


def stribeck(v):
    return 60 + 40 * np.exp(-((np.asarray(v) / 1e-3) ** 2))


@pytest.mark.parametrize("speed", [1e-5, 1e-3, -3e-3, 0.05])
def test_steady_sliding_is_the_level_and_viscous_friction(speed):
    friction = LeuvenFriction(straight, stribeck, 2.0, sigma1=300.0, sigma2=200.0)
    t = np.linspace(0, 60 * SCALE / abs(speed), 61)
    found = friction.follow(t, speed * t)[-1]
    assert found == pytest.approx(np.sign(speed) * stribeck(speed) + 200 * speed, rel=1e-6)


def test_the_motion_solves_the_differential_equation():
    # From rest, then from steady sliding backwards, where r = F_d/(2 S) is (2.34) as printed.
    amplitude, rate = 4e-4, 5.0
    t = np.linspace(0, 1.2 * np.pi / rate, 6001)
    x = amplitude * (1 - np.cos(rate * t))
    friction = LeuvenFriction(bent, lambda v: LEVEL + 0 * v, 2.0, sigma1=50.0, sigma2=30.0)
    found = friction.follow(t, x)
    turn = np.pi / rate

    def solved(rhs, span):
        return solve_ivp(rhs, span, [0.0], dense_output=True, rtol=1e-9, atol=1e-13, max_step=1e-3).sol

    def speed(s):
        return amplitude * rate * np.sin(rate * s)

    up = solved(lambda s, z: speed(s) * (1 - (bent(z) / LEVEL) ** 2), (0, turn))
    down = solved(lambda s, z: speed(s) * (1 - (bent(z / 2) / LEVEL) ** 2), (turn, t[-1]))
    force = np.where(t <= turn, bent(up(np.minimum(t, turn))[0]), LEVEL + 2 * bent(down(np.maximum(t, turn))[0] / 2))
    slip = np.where(
        t <= turn, 1 - (bent(up(np.minimum(t, turn))[0]) / LEVEL) ** 2, 1 - ((force - LEVEL) / 2 / LEVEL) ** 2
    )
    expected = force + 50 * slip * speed(t) + 30 * speed(t)
    assert found[1:] == pytest.approx(expected[1:], abs=2e-3 * LEVEL)


def test_the_motion_closes_its_inner_loops_too():
    friction = LeuvenFriction(straight, stribeck, 1.0)
    turns = SCALE * np.array([0, 1.0, 0.2, 0.8, 0.3, 0.8, 0.2, 1.0])
    x = route(turns, 101)
    force = friction.follow(np.arange(len(x)) * 1.0, x)
    at = force[99::100]  # at the turns
    assert at[5 - 1] == pytest.approx(at[3 - 1], abs=1e-3 * LEVEL)
    assert at[7 - 1] == pytest.approx(at[0], abs=1e-3 * LEVEL)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"level": 0.0}, "level 0"),
        ({"level": 100.0, "n": -1.0}, "n -1"),
        ({"level": 100.0, "curve": np.tanh}, "does not reach the level"),
        ({"level": 100.0, "curve": lambda z: 30 * np.sin(5 * z) + 20 * z}, "does not rise"),
        ({"level": 100.0, "curve": lambda z: 1 + z}, "does not rise"),
    ],
)
def test_what_is_no_stack_is_refused(options, said):
    with pytest.raises(BadParameter, match=said):
        LeuvenStack(**{"curve": lambda z: 1e3 * z, **options})


def test_what_is_no_friction_or_motion_is_refused():
    with pytest.raises(BadParameter, match="sigma1 -1"):
        LeuvenFriction(straight, stribeck, sigma1=-1.0)
    with pytest.raises(BadParameter, match="S\\(v\\) is not positive"):
        LeuvenFriction(straight, lambda v: 10 - v)
    with pytest.raises(BadParameter, match="step 0"):
        LeuvenFriction(straight, stribeck, step=0.0)
    with pytest.raises(BadParameter, match="time"):
        LeuvenFriction(straight, stribeck).follow([0.0, 0.0], [0.0, 1.0])
    with pytest.raises(BadParameter, match="path"):
        LeuvenStack(straight, LEVEL).follow([np.nan])
