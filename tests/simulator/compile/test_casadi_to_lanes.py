"""Functions of several intervals at once compute what CasADi computes, operation by operation and NaN by NaN."""

from __future__ import annotations

import ctypes
import itertools

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_casadi_to_python import OPERATIONS, VALUES, X, Y

from simulator.compile import c_loop
from simulator.compile.c_compiler import compiler, shared_library
from simulator.compile.casadi_to_lanes import lanes_source

EVERY = """
void every(long n, const double *x, double *y) {
  Lanes given[INPUTS], found[OUTPUTS];
  for (long k = 0; k < n; k += LANES) {
    for (int i = 0; i < INPUTS; ++i)
      for (int l = 0; l < LANES; ++l) given[i][l] = x[i * n + (k + l < n ? k + l : n - 1)];
    lanes_f(given, found);
    for (int i = 0; i < OUTPUTS; ++i) for (int l = 0; l < LANES && k + l < n; ++l) y[i * n + k + l] = found[i][l];
  }
}
"""


def computed(expressions: list[ca.SX], symbols: list[ca.SX], values: np.ndarray, native: bool) -> np.ndarray:
    """The expressions at columns of values, by a compiled function on lanes."""
    command = compiler()
    if command is None:
        pytest.skip("there is no C compiler on this machine")
    function = ca.Function("f", [ca.vertcat(*symbols)], [ca.vertcat(*expressions)], ["x"], ["y"])
    sizes = f"#define INPUTS {len(symbols)}\n#define OUTPUTS {len(expressions)}\n"
    source = lanes_source(function)
    assert source is not None
    library = shared_library(command, sizes + c_loop._text("lanes.c") + source + EVERY, native=native)
    x, y = np.ascontiguousarray(values), np.zeros((len(expressions), values.shape[1]))
    library.every(ctypes.c_long(x.shape[1]), ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data))
    return y


@pytest.mark.parametrize("native", [False, True])
def test_operations_mean_what_casadi_means(native):
    values = np.array(list(itertools.product(VALUES, VALUES))).T
    expressions = [ca.SX(e) for e in OPERATIONS.values()]
    function = ca.Function("f", [X, Y], [ca.vertcat(*expressions)])
    expected = np.hstack([np.array(function(*pair)) for pair in values.T])
    for name, one, other in zip(OPERATIONS, computed(expressions, [X, Y], values, native), expected, strict=True):
        assert_allclose(one, other, rtol=1e-14, atol=0, err_msg=name)


@pytest.mark.parametrize("native", [False, True])
def test_exponentials_are_right_to_some_units_in_the_last_place(native):
    near, far = (
        np.random.default_rng(1).normal(0, [[1e-9], [1e-3], [0.3], [3.0]], (4, 5000)),
        np.linspace(-760, 720, 9001),
    )
    x = np.concatenate([near.ravel(), far, np.linspace(-2000, 2000, 77), [0.0, -0.0, 709.78, -745.1]])
    exp, expm1 = computed([ca.exp(X), ca.expm1(X)], [X], x[None], native)
    with np.errstate(over="ignore"):
        assert_allclose(exp, np.exp(x), rtol=1e-15, atol=5e-324)
        assert_allclose(expm1, np.expm1(x), rtol=1e-15)


def test_what_has_no_translation_is_left_to_others():
    x = ca.SX.sym("x")
    assert lanes_source(ca.Function("f", [x], [ca.erfinv(x)])) is None
