"""Numerical failure is a value, the same in both ways of running; bad arguments are named."""

from __future__ import annotations

import functools
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import pytest
from lugre_reference import Valve, slow_force

from recordings import BadInput
from simulator import BASE, Recurrence, Scanner, kernel

T = np.linspace(0.0, 0.4, 201)
U = slow_force(T)
NAMES = kernel(BASE).parameters


def run(values=None, u=U, **options):
    k = kernel(BASE)
    return k.run(T, u, k.vector(Valve().values() | (values or {})), k.start(0.01), **options)


@pytest.mark.parametrize("wrong", [float("nan"), float("inf")])
@pytest.mark.parametrize("name", NAMES)
def test_a_parameter_that_is_no_number_fails(way, name, wrong):
    scan = run({name: wrong}, sensitivities=True)
    if name == "lugre.vs" and wrong > 0:  # no Stribeck effect: the one limit that exists
        assert scan.outputs == pytest.approx(run({"lugre.fc": 200.0}).outputs, abs=1e-12)
        return
    assert scan.failed is not None
    assert np.isinf(wrong) or run({name: wrong}).failed is not None
    assert np.isfinite(scan.outputs[: scan.failed]).all()
    assert np.isnan(scan.outputs[scan.failed :]).all()
    assert np.isnan(scan.jacobian[scan.failed :]).all()
    assert np.isnan(scan.final).all()


def test_an_input_that_is_missing_fails_where_it_is_needed(way):
    u = U.copy()
    u[100] = np.nan
    assert run(u=u).failed == 100
    assert run(u=u, hold=True).failed == 101
    assert np.isfinite(run(u=u).outputs[:100]).all()


@pytest.mark.parametrize(
    "values",
    [
        {"lugre.vs": 1e-9},
        {"lugre.sigma0": 1e14},
        {"lugre.sigma0": 1e14, "lugre.sigma1": 0.0},
        {"lugre.fs": 50.0},
        {"lugre.fs": 0.0},
        {"lugre.fc": 0.0, "lugre.fs": 0.0},
        {"lugre.sigma1": 1e7},
        {"mass.m": 1e-6},
        {"mass.m": 1e6},
        {"spring.K": 0.0},
    ],
    ids=str,
)
def test_extreme_parameters_have_a_finite_answer(way, values):
    scan = run(values, sensitivities=True)
    assert scan.failed is None
    assert abs(scan.outputs).max() < 1e3
    assert np.isfinite(scan.jacobian).all()


def test_a_huge_bristle_stiffness_is_dry_friction(way):
    stiff, stiffer = (run({"lugre.sigma0": s, "lugre.sigma1": 0.01 * s**0.5}, h_max=1e-4) for s in (1e9, 1e12))
    assert np.ptp(stiff.outputs) > 2e-3
    assert abs(stiff.outputs - stiffer.outputs).max() < 1e-4


ROOTS = {
    "cubic": (lambda w: w**3 - 8, 2.0),
    "jump": (lambda w: ca.sign(w - 0.3), 0.3),
    "flat": (lambda w: ca.atan(1e4 * (w - 7)), 7.0),
    "friction": (lambda w: w - 1 + 50 * ca.tanh((w - 1) * 1e6), 1.0),
    "falling at the start": (lambda w: w + 40 * ca.exp(-(w**2)) - 60, 60.0),
    "falling root beside it": (lambda w: w**3 - w, 1.0),
    "too steep for Newton": (lambda w: ca.exp(300 * (w + 2)) - 1, -2.0),
    "none above": (lambda w: ca.tanh(w) - 2, None),
    "none below": (lambda w: 2 + ca.tanh(w), None),
    "none at all": (lambda w: 1 + w * w, None),
    "pole": (lambda w: 1 / w, None),
}
"""Equations in w, each with its root."""


@functools.cache
def root_finder(_way):
    """A recurrence of one state whose step is the root of the equation that the parameter numbers."""
    s, e, p, w = ca.SX.sym("s"), ca.SX.sym("e", 2), ca.SX.sym("p"), ca.SX.sym("w")
    residual = sum(ca.if_else(p == i, equation(w), 0) for i, (equation, _) in enumerate(ROOTS.values()))
    return Scanner(Recurrence(s, e, p, w, s, implicit=w, residual=residual, guess=s))


@pytest.mark.parametrize("name", ROOTS)
def test_the_search_for_a_root_is_safe_and_ends(way, name):
    number, root = list(ROOTS).index(name), ROOTS[name][1]
    scan = root_finder(way).run(np.arange(2.0), np.zeros((2, 0)), np.array([float(number)]), np.zeros(1))
    assert scan.failed == (1 if root is None else None)
    assert scan.outputs[1, 0] == pytest.approx(np.nan if root is None else root, rel=1e-9, nan_ok=True)


def test_threads_do_not_disturb_each_other(way):
    values = [{"lugre.fc": 100.0 + i} for i in range(8)]
    alone = [run(v, sensitivities=True) for v in values]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda v: run(v, sensitivities=True), values))
    for one, other in zip(alone, together, strict=True):
        assert (one.outputs == other.outputs).all()
        assert (one.jacobian == other.jacobian).all()


def test_arguments_stay_as_they_are_and_may_be_read_only(way):
    k = kernel(BASE)
    given = [T.copy(), U.copy(), k.vector(Valve().values()), k.start(0.01)]
    for array in given:
        array.setflags(write=False)
    assert (k.run(*given).outputs == run().outputs).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"t": T[::-1]}, "rise"),
        ({"t": np.zeros(201)}, "rise"),
        ({"t": T[:-1]}, "u has the shape"),
        ({"t": T[:0], "u": U[:0]}, "at least"),
        ({"p": np.ones(3)}, "p has the shape"),
        ({"s0": np.ones(2)}, "s0 has the shape"),
        ({"resets": np.ones((2, 3))}, "one row per sample"),
        ({"h_max": 1e-15}, "h_max"),
        ({"h_max": -1.0}, "h_max"),
        ({"h_max": float("nan")}, "h_max"),
    ],
    ids=lambda value: str(list(value)) if isinstance(value, dict) else value,
)
def test_arguments_that_do_not_fit_are_named(change, said):
    k = kernel(BASE)
    arguments = {"t": T, "u": U, "p": k.vector(Valve().values()), "s0": k.start(0.01)} | change
    with pytest.raises(ValueError, match=said):
        k.run(**arguments)


def test_kernels_that_cannot_be_are_refused():
    with pytest.raises(KeyError, match="no effect named 'gravity'"):
        kernel(("inertia", "gravity"))
    with pytest.raises(BadInput, match="none"):
        kernel(())
    with pytest.raises(KeyError, match=r"mass\.m"):
        kernel(BASE).vector({"spring.K": 1.0})


def test_a_kernel_is_made_once(way):
    assert kernel(["lugre", "inertia", "spring"]) is kernel(BASE)
    assert kernel(BASE).effects == ("inertia", "spring", "lugre")
    assert kernel(BASE, "motion") is not kernel(BASE)
