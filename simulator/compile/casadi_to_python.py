"""CasADi scalar functions as straight-line Python source, for machines without a C compiler.

Every operation becomes one assignment that means what it means in the C source CasADi generates for the same
function, so that both give the same numbers. The names it uses are those of `math` and
`simulator.compile.arithmetic`, and `np` for what numba's `math` does differently from C.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import casadi as ca

FORMULAS = {
    "ADD": "{0} + {1}", "SUB": "{0} - {1}", "MUL": "{0} * {1}", "DIV": "{0} / {1}", "NEG": "-{0}", "SQ": "{0} * {0}",
    "TWICE": "2.0 * {0}", "INV": "1.0 / {0}", "ASSIGN": "{0}", "LT": "1.0 * ({0} < {1})", "LE": "1.0 * ({0} <= {1})",
    "EQ": "1.0 * ({0} == {1})", "NE": "1.0 * ({0} != {1})", "NOT": "1.0 * ({0} == 0.0)",
    "AND": "1.0 * (({0} != 0.0) & ({1} != 0.0))", "OR": "1.0 * (({0} != 0.0) | ({1} != 0.0))",
    "IF_ELSE_ZERO": "taken({0}, {1})", "CONSTPOW": "pow({0}, {1})", "FLOOR": "np.floor({0})", "CEIL": "np.ceil({0})",
    "FMOD": "np.fmod({0}, {1})",
}  # fmt: skip
"""Operations that are written in their own way; `UNARY` and `BINARY` are calls of a function of the same name."""

UNARY = (
    "EXP", "LOG", "SQRT", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "SINH", "COSH", "TANH", "ASINH", "ACOSH",
    "ATANH", "EXPM1", "LOG1P", "ERF", "FABS", "SIGN",
)  # fmt: skip
BINARY = ("POW", "ATAN2", "HYPOT", "REMAINDER", "COPYSIGN", "FMIN", "FMAX")

_OPERATIONS = {
    getattr(ca, f"OP_{name}"): formula
    for name, formula in {
        **FORMULAS,
        **{name: f"{name.lower()}({{0}})" for name in UNARY},
        **{name: f"{name.lower()}({{0}}, {{1}})" for name in BINARY},
    }.items()
}
_NAMES = {getattr(ca, name): name for name in dir(ca) if name.startswith("OP_")}


def python_source(function: ca.Function, scalars: tuple[str, ...] = (), returned: bool = False) -> str:
    """The source of a Python function that computes what an SX function with dense outputs computes.

    Its arguments are i0, i1, ... for the inputs, flat arrays or, when their CasADi name is among `scalars`, numbers;
    then o0, o1, ... flat arrays (column-major) that it fills, or it returns the outputs, which then are scalars.
    Raises NotImplementedError for an operation that has no translation, ValueError for a free symbol.

    >>> x = ca.SX.sym("x")
    >>> print(python_source(ca.Function("double", [x], [x + x], ["x"], ["y"]), scalars=("x",), returned=True))
    def double(i0):
        w0 = i0
        w0 = 2.0 * w0
        r0 = w0
        return r0
    """
    if function.has_free():
        raise ValueError(f"{function.name()}: the symbols {function.free_sx()} are neither states nor parameters")
    inputs = [f"i{i}" for i in range(function.n_in())]
    outputs = [] if returned else [f"o{i}" for i in range(function.n_out())]
    lines = list(_statements(function, scalars, returned))
    if returned:
        lines.append(f"return {', '.join(f'r{i}' for i in range(function.n_out()))}")
    return "\n    ".join([f"def {function.name()}({', '.join(inputs + outputs)}):", *(lines or ["pass"])])


def _statements(function: ca.Function, scalars: tuple[str, ...], returned: bool) -> Iterator[str]:
    names = function.name_in()
    for k in range(function.n_instructions()):
        operation, given, result = (
            function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        )  # fmt: skip
        if operation == ca.OP_INPUT:
            whole = names[given[0]] in scalars
            yield f"w{result[0]} = i{given[0]}" + ("" if whole else f"[{given[1]}]")
        elif operation == ca.OP_OUTPUT:
            yield f"{f'r{result[0]}' if returned else f'o{result[0]}[{result[1]}]'} = w{given[0]}"
        elif operation == ca.OP_CONST:
            yield f"w{result[0]} = {_constant(function.instruction_constant(k))}"
        elif operation in _OPERATIONS:
            yield f"w{result[0]} = " + _OPERATIONS[operation].format(*(f"w{i}" for i in given))
        else:
            raise NotImplementedError(
                f"{function.name()}: the operation {_NAMES.get(operation, operation)} cannot run without a C compiler; "
                f"install one, or write the expression with other functions"
            )


def _constant(value: float) -> str:
    """A number as source: shortest text that gives it back, with the names `inf` and `nan`."""
    return repr(float(value)) if math.isfinite(value) else str(float(value)) if value == value else "nan"
