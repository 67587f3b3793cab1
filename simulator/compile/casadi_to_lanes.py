"""CasADi scalar functions as C that works on several intervals at once (`lanes.c`)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import casadi as ca

FORMULAS = {
    "ADD": "{0} + {1}", "SUB": "{0} - {1}", "MUL": "{0} * {1}", "DIV": "{0} / {1}", "NEG": "-{0}", "SQ": "{0} * {0}",
    "TWICE": "{0} + {0}", "INV": "1 / {0}", "ASSIGN": "{0}", "LT": "truth({0} < {1})", "LE": "truth({0} <= {1})",
    "EQ": "truth({0} == {1})", "NE": "truth({0} != {1})", "NOT": "truth({0} == 0)",
    "AND": "truth(({0} != 0) & ({1} != 0))", "OR": "truth(({0} != 0) | ({1} != 0))", "IF_ELSE_ZERO": "taken({0}, {1})",
    "CONSTPOW": "lanes_pow({0}, {1})", "EXP": "exponential({0})", "EXPM1": "exponential_less_1({0})",
    "FABS": "absolute({0})", "SQRT": "root({0})", "SIGN": "sign_of({0})", "FMIN": "smaller({0}, {1})",
    "FMAX": "larger({0}, {1})",
}  # fmt: skip
"""Operations in a way of their own; `UNARY` and `BINARY` are those of the C library, number by number."""

UNARY = (
    "LOG", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "SINH", "COSH", "TANH", "ASINH", "ACOSH", "ATANH", "LOG1P",
    "ERF", "FLOOR", "CEIL",
)  # fmt: skip
BINARY = ("POW", "ATAN2", "HYPOT", "REMAINDER", "COPYSIGN", "FMOD")

_OPERATIONS = {
    getattr(ca, f"OP_{name}"): formula
    for name, formula in {
        **FORMULAS,
        **{name: f"lanes_{name.lower()}({{0}})" for name in UNARY},
        **{name: f"lanes_{name.lower()}({{0}}, {{1}})" for name in BINARY},
    }.items()
}


def lanes_source(function: ca.Function, shared: tuple[str, ...] = ()) -> str | None:
    """The source of a C function that computes what an SX function does; None for an operation without translation.

    Its arguments are i0, i1, ... for the inputs, vectors of `Lanes`, or of numbers where all intervals share them
    (`shared`, by CasADi name), then o0, o1, ... that it fills, with the entries that are structurally not zero.

    >>> x = ca.SX.sym("x")
    >>> print(lanes_source(ca.Function("twice", [x], [x + x], ["x"], ["y"])))
    static inline void lanes_twice(const Lanes *i0, Lanes *o0) {
      Lanes w0;
      w0 = i0[0];
      w0 = w0 + w0;
      o0[0] = w0;
    }
    """
    operations = {function.instruction_id(k) for k in range(function.n_instructions())}
    if operations - {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST} - set(_OPERATIONS):
        return None
    kinds = ["double" if name in shared else "Lanes" for name in function.name_in()]
    given = [f"const {kind} *i{i}" for i, kind in enumerate(kinds)]
    filled = [f"Lanes *o{i}" for i in range(function.n_out())]
    places = range(function.sz_w())
    lines = ["Lanes " + ", ".join(f"w{i}" for i in places) + ";", *_statements(function, shared)]
    body = "\n  ".join(lines if len(places) else [])
    return f"static inline void lanes_{function.name()}({', '.join(given + filled)}) {{\n  {body}\n}}"


def _statements(function: ca.Function, shared: tuple[str, ...]) -> Iterator[str]:
    names = function.name_in()
    for k in range(function.n_instructions()):
        operation, given, result = (
            function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        )  # fmt: skip
        if operation == ca.OP_INPUT:
            value = f"i{given[0]}[{given[1]}]"
            yield f"w{result[0]} = {f'all({value})' if names[given[0]] in shared else value};"
        elif operation == ca.OP_OUTPUT:
            yield f"o{result[0]}[{result[1]}] = w{given[0]};"
        elif operation == ca.OP_CONST:
            yield f"w{result[0]} = all({_constant(function.instruction_constant(k))});"
        else:
            yield f"w{result[0]} = {_OPERATIONS[operation].format(*(f'w{i}' for i in given))};"


def _constant(value: float) -> str:
    if math.isfinite(value):
        return repr(float(value))
    return "NAN" if math.isnan(value) else "INFINITY" if value > 0 else "-INFINITY"
