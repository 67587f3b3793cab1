"""Forward sensitivities: against finite differences, and the two ways of compiling against each other."""

from __future__ import annotations

import shutil

import casadi as ca
import numpy as np
import pytest
from lugre_reference import Valve, slow_force

from simulator import BASE, Recurrence, Scanner, kernel

T = np.linspace(0.0, 1.0, 501)
MOTION = np.column_stack([0.01 * np.sin(9 * T), 0.09 * np.cos(9 * T), -0.81 * np.sin(9 * T), 0 * T])
CASES = {"force": (slow_force(T), np.array([0.012, 0.01, 5e-5])), "motion": (MOTION, np.array([5e-5]))}


def run(causality, p, s0, **options):
    return kernel(BASE, causality).run(T, CASES[causality][0], p, s0, h_max=5e-4, **options)


def differences(causality, p, s0, column):
    """Central differences of the output by a parameter or, behind those, an initial state."""
    whole = np.concatenate([p, s0])
    size = 1e-5 * np.concatenate([abs(p), [1e-2, 1e-1, 1e-4][-len(s0) :]])[column]
    ends = []
    for sign in (1, -1):
        moved = whole.copy()
        moved[column] += sign * size
        ends.append(run(causality, moved[: len(p)], moved[len(p) :]).outputs[:, 0])
    return (ends[0] - ends[1]) / (2 * size)


@pytest.mark.parametrize("causality", CASES)
@pytest.mark.parametrize("stiffness", [1e5, 1e6, 1e7])
def test_jacobian_is_what_finite_differences_say(way, causality, stiffness):
    p, s0 = kernel(BASE, causality).vector(Valve.stiff(stiffness).values()), CASES[causality][1]
    jacobian = run(causality, p, s0, sensitivities=True).jacobian
    assert jacobian.shape == (501, 1, len(p) + len(s0))
    for column in range(len(p) + len(s0)):
        exact, seen = jacobian[:, 0, column], differences(causality, p, s0, column)
        assert np.linalg.norm(exact) > 0
        assert np.linalg.norm(seen - exact) < 1e-5 * np.linalg.norm(exact), column


def test_outputs_do_not_depend_on_whether_derivatives_are_asked_for(way):
    p, s0 = kernel(BASE).vector(Valve().values()), CASES["force"][1]
    plain, full = run("force", p, s0), run("force", p, s0, sensitivities=True)
    assert plain.jacobian is None
    assert full.outputs == pytest.approx(plain.outputs, abs=1e-15)
    assert full.final == pytest.approx(plain.final, rel=1e-12)


@pytest.mark.parametrize("causality", CASES)
def test_both_ways_of_compiling_give_the_same_numbers(causality, monkeypatch):
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        pytest.skip("there is no C compiler on this machine")
    p, s0 = kernel(BASE, causality).vector(Valve.stiff(1e7).values()), CASES[causality][1]
    with_compiler = run(causality, p, s0, sensitivities=True)
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    assert not kernel(BASE, causality).scanner.compiled
    without = run(causality, p, s0, sensitivities=True)
    for one, other in zip(
        (with_compiler.outputs, with_compiler.final, with_compiler.jacobian),
        (without.outputs, without.final, without.jacobian),
        strict=True,
    ):
        assert abs(one - other).max() <= 1e-12 * abs(one).max()
    columns = abs(with_compiler.jacobian - without.jacobian).max(axis=(0, 1))
    assert (columns <= 1e-10 * abs(with_compiler.jacobian).max(axis=(0, 1))).all()


def test_a_recurrence_of_ones_own_may_do_without_an_implicit_scalar_and_ask_for_inputs_at_the_end(way):
    s, e, p = ca.SX.sym("s", 2), ca.SX.sym("e", 4), ca.SX.sym("p")
    step = ca.vertcat(s[0] + e[1] * p * e[2], e[3])
    scanner = Scanner(Recurrence(s, e, p, step, ca.vertcat(s, s[0] ** 2), ends=True))
    t = np.array([0.0, 1.0, 3.0])
    scan = scanner.run(t, np.array([2.0, 4.0, 8.0]), np.array([0.5]), np.zeros(2), h_max=0.5, sensitivities=True)
    assert scan.outputs == pytest.approx(np.array([[0, 0, 0], [1.5, 4, 2.25], [7.5, 8, 56.25]]))
    assert scan.jacobian[:, 0] == pytest.approx(np.array([[0, 1, 0], [3, 1, 0], [15, 1, 0]]))
    assert scan.jacobian[-1, 2] == pytest.approx(np.array([15 * 15, 15, 0]))
