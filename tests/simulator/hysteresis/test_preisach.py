"""Preisach models: against direct integration over the plane, their two properties each, and learned from curves."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from recordings import BadParameter
from simulator.hysteresis import (
    Everett,
    MovingPreisach,
    NonlinearPreisach,
    Preisach,
    ReversalCurve,
    first_order_curves,
    second_order_curves,
)

QUICK = settings(max_examples=40, deadline=None, derandomize=True)
INPUTS = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=14)
LEVELS = np.linspace(0, 1, 21)


def smooth(a, b):
    """F of the weight mu = alpha^2 + beta + 1 over the triangle."""
    return (a**4 - b**4) / 4 - b * (a**3 - b**3) / 3 + (a**3 - b**3) / 6 - b**2 * (a - b) / 2 + (a - b) ** 2 / 2


def by_integration(history):
    """(2.53) as an integral over the plane: at each alpha the relays are up to the lowest input since one above it."""

    def strip(alpha, low, high):  # the integral of mu over beta
        return (alpha**2 + 1) * (high - low) + (high**2 - low**2) / 2

    def along(alpha):
        above = [k for k, u in enumerate(history) if u >= alpha]
        edge = min([alpha, *history[above[-1] :]]) if above else 0.0
        return strip(alpha, 0.0, edge) - strip(alpha, edge, alpha)

    kinks = sorted({0.0, 1.0, *history})
    return sum(quad(along, a, b, epsabs=1e-12)[0] for a, b in itertools.pairwise(kinks))


@QUICK
@given(INPUTS)
def test_both_branches_are_the_integral_over_the_plane(inputs):
    model = Preisach(smooth, 0.0, 1.0)
    found = [model.update(u) for u in inputs]
    assert found[-1] == pytest.approx(by_integration([0.0, *inputs]), abs=1e-9)


def everett(curves=smooth, levels=LEVELS):
    return Everett(levels, [[curves(a, b) if b < a else 0.0 for b in levels] for a in levels], middle=0.3)


@QUICK
@given(INPUTS, st.data())
def test_the_compiled_loop_is_the_sum(inputs, data):
    F = everett()
    slow, fast = Preisach(F, 0.0, 1.0, 0.3), Preisach(F, 0.0, 1.0, 0.3)
    cut = data.draw(st.integers(0, len(inputs)))
    first, second = fast.follow(inputs[:cut]), fast.follow(inputs[cut:])
    expected = [slow.update(u) for u in inputs]
    assert np.concatenate([first, second]) == pytest.approx(expected, abs=1e-12)
    assert fast.memory == slow.memory


@QUICK
@given(INPUTS, st.floats(0.0, 1.0))
def test_wiping_out(inputs, last):
    model, short = Preisach(everett(), 0.0, 1.0), Preisach(everett(), 0.0, 1.0)
    model.follow([*inputs, last])
    short.follow([*model.memory, last])  # the dominant extrema are all that is left of the past
    path = np.array([0.3, 0.8, 0.1, 0.95])
    assert model.follow(path) == pytest.approx(short.follow(path), abs=1e-12)
    assert model.update(0.0) == pytest.approx(Preisach(everett(), 0.0, 1.0).update(0.0), abs=1e-12)


@QUICK
@given(INPUTS, INPUTS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_congruency(one, other, a, b):
    def loop(history):
        model = Preisach(smooth, 0.0, 1.0)
        model.follow([*history, a, b])
        found = model.follow(np.concatenate([np.linspace(b, a, 7), np.linspace(a, b, 7)]))
        return found - found[0]

    assert loop(one) == pytest.approx(loop(other), abs=1e-12)


def test_it_is_learned_from_measured_curves():
    true = Preisach(smooth, 0.0, 1.0, middle=2.0)
    errors = []
    path = np.random.default_rng(5).uniform(0, 1, 300)
    expected = Preisach(smooth, 0.0, 1.0, middle=2.0).follow(path)
    for n in (6, 11, 21):
        learned = Preisach.learned(first_order_curves(true.update, np.linspace(0, 1, n), samples=3))
        errors.append(np.abs(learned.follow(path) - expected).max())
    assert errors[-1] < 2e-3 * np.ptp(expected)
    assert errors[0] / errors[1] > 2.5  # second order in the spacing of the levels
    assert errors[1] / errors[2] > 2.5


def test_noise_makes_weights_negative_and_they_can_be_removed():
    rng = np.random.default_rng(3)
    true = Preisach(smooth, 0.0, 1.0)
    levels = np.linspace(0, 1, 9)
    curves = [
        ReversalCurve(c.input, c.output + 3e-2 * rng.normal(size=len(c.output)))
        for c in first_order_curves(true.update, levels)
    ]
    with pytest.raises(BadParameter, match="lies below"):
        Everett.learned(curves)
    kept = Everett.learned(curves, noise=3e-2)
    removed = Everett.learned(curves, negative="remove", noise=3e-2)
    exact = Everett.learned(first_order_curves(true.update, levels), negative="refuse")
    assert kept.weights.min() < 0 <= removed.weights.min() + 1e-12
    spoiled = [ReversalCurve(c.input, c.output + 0.02 * np.sin(9 * c.input) * c.input[0]) for c in curves]
    with pytest.raises(BadParameter, match="the weight mu is -"):
        Everett.learned(spoiled, negative="refuse", noise=0.1)
    assert np.abs(removed.values - exact.values).max() < 0.1
    assert exact.weights.sum() == pytest.approx(exact.values[-1, 0])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c: c[:1], "too few"),
        (lambda c: [*c, c[-1]], "two from one reversal value"),
        (lambda c: [*c[:-1], ReversalCurve(c[-1].input[:3], c[-1].output[:3])], "it ends at 0.6, before 0"),
        (lambda c: [*c[:-1], ReversalCurve(c[-1].input[[0, 1, 5]], c[-1].output[[0, 1, 5]])], "gap from 0.8 to 0"),
        (lambda c: [*c[:-1], ReversalCurve(c[-1].input, c[-1].output - 1)], "curves from 1: at 0 it lies below"),
    ],
)
def test_curves_with_gaps_and_crossing_curves_are_refused(change, said):
    curves = first_order_curves(Preisach(smooth, 0.0, 1.0).update, np.linspace(0, 1, 6))
    with pytest.raises(BadParameter, match=said):
        Everett.learned(change(curves))


def test_second_order_curves_that_cross_are_refused_unless_by_noise():
    levels = np.linspace(0, 1, 6)
    first, second = second_order_curves(Bent().update, levels)
    swapped = second.copy()
    swapped[5, 1, 3:5], swapped[5, 2, 3:5] = second[5, 2, 3:5], second[5, 1, 3:5]
    with pytest.raises(BadParameter, match=r"the curve from 1 over 0\.2 lies above that over 0\.4 at 0\.6"):
        NonlinearPreisach.learned(levels, first, swapped)
    lowered = first.copy()
    lowered[5] -= 0.5
    with pytest.raises(BadParameter, match=r"curves from 1: at 0 it lies below the one from 0\.8"):
        NonlinearPreisach.learned(levels, lowered, second)
    curves = first_order_curves(Preisach(smooth, 0.0, 1.0).update, levels)
    with pytest.raises(BadParameter, match="curves from 1: at 0 it lies below"):
        MovingPreisach.learned([*curves[:-1], ReversalCurve(curves[-1].input, curves[-1].output - 1)])
    noisy = second + 1e-3 * np.random.default_rng(2).normal(size=second.shape)
    with pytest.raises(BadParameter, match="second"):
        NonlinearPreisach.learned(levels, first, noisy)
    assert NonlinearPreisach.learned(levels, first, noisy, noise=1e-3).update(0.5) == pytest.approx(
        NonlinearPreisach.learned(levels, first, second).update(0.5), abs=0.01
    )


def test_what_is_no_model_is_refused():
    with pytest.raises(BadParameter, match="negative drop: it is no way to treat it; one of keep, refuse, remove"):
        Everett.learned(first_order_curves(Preisach(smooth, 0.0, 1.0).update, LEVELS), negative="drop")
    with pytest.raises(BadParameter, match="input: it does not fall"):
        ReversalCurve([0.0, 1.0], [0.0, 1.0])
    with pytest.raises(BadParameter, match="output"):
        ReversalCurve([1.0, 0.0], [0.0])
    with pytest.raises(BadParameter, match=r"F\(a, a\) is not 0"):
        Everett([0, 1], [[1, 0], [0, 0]])
    with pytest.raises(BadParameter, match="levels"):
        Everett([1, 0], np.zeros((2, 2)))
    for kind in (lambda: MovingPreisach(abs, abs, smooth, 1.0, 1.0), lambda: NonlinearPreisach(abs, smooth, 2.0, 1.0)):
        with pytest.raises(BadParameter, match="low is less than high"):
            kind()
    first, second = second_order_curves(Preisach(smooth, 0.0, 1.0).update, np.linspace(0, 1, 4))
    for table, said in ((second[:2], "beside first"), (second * np.nan, "not finite"), (second + 1, "lies above")):
        with pytest.raises(BadParameter, match=said):
            NonlinearPreisach.learned(np.linspace(0, 1, 4), first, table)
    with pytest.raises(BadParameter, match="path"):
        Preisach(smooth, 0.0, 1.0).follow([np.inf])


def test_the_moving_model_is_the_classical_one_within_the_loop_and_not_beyond():
    curves = first_order_curves(Preisach(smooth, 0.0, 1.0).update, LEVELS)
    classical = Preisach.learned(curves)
    top = float(classical.follow([1.0])[0])
    moving = MovingPreisach.learned(curves, above=lambda u: top + 3 * (u - 1.0))
    path = np.random.default_rng(8).uniform(0, 1, 200)
    classical.update(0.0)
    expected = classical.follow(path)
    assert [moving.update(u) for u in path] == pytest.approx(expected, abs=1e-12)
    assert moving.update(1.5) == pytest.approx(top + 1.5)
    assert moving.update(0.4) == pytest.approx(classical.follow([1.0, 0.4])[-1], abs=1e-12)
    assert moving.update(-2.0) == pytest.approx(classical.update(-2.0))


def test_the_moving_sum_is_the_integral_with_a_factor_of_one():
    # (2.63) as printed has 2 sum(...): with T = 2 times the weight it does not give f.
    up, down = (lambda u: 2 * smooth(u, 0.0) - smooth(1.0, 0.0)), (lambda u: smooth(1.0, 0.0) - 2 * smooth(1.0, u))

    def T(a, b):
        return down(b) - (up(a) - 2 * smooth(a, b))

    model = MovingPreisach(up, down, T, 0.0, 1.0)
    history = [0.0]
    for u in (0.8, 0.3, 0.6, 0.45, 0.5, 0.9, 0.1):
        history.append(u)
        assert model.update(u) == pytest.approx(by_integration(history), abs=1e-9)


def bent(u, plain):
    """An output whose chords depend on the input: mu(alpha, beta) (1 + u), which is not congruent."""
    return plain * (1 + u)


class Bent:
    """What the nonlinear model describes and the classical one does not."""

    def __init__(self):
        self.plain = Preisach(smooth, 0.0, 1.0)

    def update(self, u):
        return bent(u, self.plain.update(u))


def nonlinear(n):
    levels = np.linspace(0, 1, n)
    return NonlinearPreisach.learned(levels, *second_order_curves(Bent().update, levels))


class Saturating(Bent):
    """An output of neither class: not even its chords are equal, only its memory is that of the models."""

    def update(self, u):
        return np.tanh(2 * self.plain.update(u))


@pytest.mark.parametrize(("kind", "share"), [(Bent, 0.1), (Saturating, 0.35)])
def test_the_nonlinear_model_beats_the_classical_one_where_congruency_breaks(kind, share):
    path, true = np.random.default_rng(11).uniform(0, 1, 150), kind()
    expected = np.array([true.update(u) for u in path])
    model = NonlinearPreisach.learned(LEVELS, *second_order_curves(kind().update, LEVELS))
    classical = Preisach.learned(first_order_curves(kind().update, LEVELS))
    ours = np.sqrt(np.mean((np.array([model.update(u) for u in path]) - expected) ** 2))
    theirs = np.sqrt(np.mean((classical.follow(path) - expected) ** 2))
    assert ours < share * theirs


def test_the_nonlinear_model_is_the_integral_with_its_weight():
    def first(a, u):
        return bent(u, 2 * (smooth(a, 0.0) - smooth(a, u)) - smooth(1.0, 0.0))

    def P(a, b, u):
        second = 2 * (smooth(a, 0.0) - smooth(a, b) + smooth(u, b)) - smooth(1.0, 0.0)
        return first(a, u) - bent(u, second)

    model, history = NonlinearPreisach(lambda u: first(1.0, u), P, 0.0, 1.0), [0.0]
    for u in (0.8, 0.3, 0.6, 0.45, 0.5, 0.9, 0.1):
        history.append(u)
        assert model.update(u) == pytest.approx(bent(u, by_integration(history)), abs=1e-9)


MODEL = nonlinear(6)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(INPUTS, INPUTS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_vertical_chords_are_equal(one, other, a, b):
    inputs = np.linspace(min(a, b), max(a, b), 5)

    def chords(history):
        for u in (0.0, *history, max(a, b), min(a, b)):
            MODEL.update(u)
        up = [MODEL.update(u) for u in inputs]
        return np.array([MODEL.update(u) for u in inputs[::-1]])[::-1] - up

    assert chords(one) == pytest.approx(chords(other), abs=1e-9)


def test_one_curve_from_the_top_is_enough_for_the_memory_of_the_nonlinear_model():
    model = nonlinear(5)
    for u in (0.9, 0.2, 0.7, 0.3, 0.75):
        model.update(u)
    assert model.memory == (0.0, 0.9, 0.2)
