"""Translated functions compute what CasADi computes, operation by operation and NaN by NaN."""

from __future__ import annotations

import itertools
import math

import casadi as ca
import numpy as np
import pytest

from simulator.compile import arithmetic
from simulator.compile.casadi_to_python import python_source

X, Y = ca.SX.sym("x"), ca.SX.sym("y")
OPERATIONS = {
    **{f.__name__: f(X) for f in (
        ca.exp, ca.log, ca.sqrt, ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan, ca.sinh, ca.cosh, ca.tanh, ca.asinh,
        ca.acosh, ca.atanh, ca.expm1, ca.log1p, ca.erf, ca.fabs, ca.floor, ca.ceil, ca.sign, ca.logic_not,
    )},
    **{f.__name__: f(X, Y) for f in (
        ca.fmin, ca.fmax, ca.atan2, ca.hypot, ca.fmod, ca.remainder, ca.copysign, ca.logic_and, ca.logic_or,
    )},
    "sum": X + Y, "difference": X - Y, "product": X * Y, "quotient": X / Y, "negative": -X, "square": X**2,
    "double": X + X, "inverse": 1 / X, "power": X**Y, "fixed power": X**2.5, "root": X**0.5, "less": X < Y,
    "less or equal": X <= Y, "equal": X == Y, "different": X != Y, "choice": ca.if_else(X < Y, X, 3 * Y),
    "constant": ca.SX(0.1) + 0 * X, "infinity": ca.SX(math.inf) * X, "not a number": ca.SX(math.nan) + X,
}  # fmt: skip
VALUES = (0.0, -0.0, 0.3, -0.7, 1.0, 2.5, -3.0, 7.25, 1e300, math.inf, -math.inf, math.nan)


@pytest.fixture(scope="module")
def both():
    """All operations in one function: by CasADi, and translated and compiled by numba."""
    function = ca.Function("f", [X, Y], [ca.SX(expression) for expression in OPERATIONS.values()], ["x", "y"],
                           [f"r{i}" for i in range(len(OPERATIONS))])  # fmt: skip
    namespace = {"np": np, **vars(math), **{name: getattr(arithmetic, name) for name in arithmetic.__all__}}
    exec(python_source(function, scalars=("x", "y"), returned=True), namespace)
    return function, arithmetic.native(namespace["f"])


@pytest.mark.parametrize("values", list(itertools.product(VALUES, VALUES)), ids=str)
def test_operations_mean_what_casadi_means(both, values):
    expected, found = ([float(value) for value in function(*values)] for function in both)
    assert dict(zip(OPERATIONS, found, strict=True)) == pytest.approx(
        dict(zip(OPERATIONS, expected, strict=True)), rel=1e-14, abs=0, nan_ok=True
    )


def test_vectors_and_matrices_are_flat_and_column_major():
    v = ca.SX.sym("v", 2)
    function = ca.Function("f", [v, X], [v * X, ca.densify(ca.jacobian(ca.vertcat(v[0] * v[1], X * v[0]), v))],
                           ["v", "x"], ["a", "b"])  # fmt: skip
    namespace: dict = {}
    exec(python_source(function, scalars=("x",)), namespace)
    a, b = np.zeros(2), np.zeros(4)
    namespace["f"](np.array([2.0, 3.0]), 5.0, a, b)
    assert a.tolist() == [10, 15]
    assert b.tolist() == [3, 5, 2, 0]


def test_what_cannot_be_translated_is_named():
    function = ca.Function("f", [X], [ca.erfinv(X)])
    with pytest.raises(NotImplementedError, match="OP_ERFINV cannot run without a C compiler"):
        python_source(function)
    with pytest.raises(ValueError, match="neither states nor parameters"):
        python_source(ca.Function("f", [X], [X + Y], {"allow_free": True}))
