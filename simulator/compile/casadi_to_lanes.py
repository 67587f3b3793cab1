"""CasADi scalar functions as C that works on several intervals at once (`lanes.c`)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import casadi as ca

FORMULAS = {
    "ADD": "{0} + {1}", "SUB": "{0} - {1}", "MUL": "{0} * {1}", "NEG": "-{0}", "SQ": "{0} * {0}",
    "TWICE": "{0} + {0}", "ASSIGN": "{0}", "LT": "truth({0} < {1})", "LE": "truth({0} <= {1})",
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

_ARITHMETIC = {getattr(ca, f"OP_{name}") for name in ("ADD", "SUB", "MUL", "NEG", "SQ", "TWICE", "ASSIGN")}
"""Operations that C has for vectors, for numbers, and for both together."""


def lanes_source(function: ca.Function, shared: tuple[str, ...] = ()) -> str | None:
    """The source of a C function that computes what an SX function does; None for an operation without translation.

    Its arguments are i0, i1, ... for the inputs, vectors of `Lanes`, or of numbers where all intervals share them
    (`shared`, by CasADi name), then o0, o1, ... that it fills, with the entries that are structurally not zero. What
    follows from shared numbers alone is computed once, and what is divided by twice, as its inverse.

    >>> x, y = ca.SX.sym("x"), ca.SX.sym("y")
    >>> print(lanes_source(ca.Function("share", [x, y], [x / (y + y)], ["x", "y"], ["z"]), ("y",)))
    static inline void lanes_share(const Lanes *i0, const double *i1, Lanes *o0) {
      const Lanes w0 = i0[0];
      const double w1 = i1[0];
      const double w2 = w1 + w1;
      const double r2 = 1 / w2;
      const Lanes w3 = w0 * r2;
      o0[0] = w3;
    }
    """
    operations = {function.instruction_id(k) for k in range(function.n_instructions())}
    if operations - {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_DIV, ca.OP_INV} - set(_OPERATIONS):
        return None
    given = [f"const {'double' if name in shared else 'Lanes'} *i{i}" for i, name in enumerate(function.name_in())]
    filled = [f"Lanes *o{i}" for i in range(function.n_out())]
    body = "\n  ".join(_Translation(function, shared).lines())
    return f"static inline void lanes_{function.name()}({', '.join(given + filled)}) {{\n  {body}\n}}"


class _Translation:
    """One function on its way: a name of its own for every value."""

    def __init__(self, function: ca.Function, shared: tuple[str, ...]) -> None:
        self.function, self.shared = function, shared
        self.held: dict[int, int] = {}  # the value that a place of CasADi's working memory holds
        self.alike: list[bool] = []  # whether a value is the same number for all intervals
        self.inverted: set[int] = set()

    def lines(self) -> Iterator[str]:
        """The assignments."""
        for k in range(self.function.n_instructions()):
            operation, given, result = (
                self.function.instruction_id(k), self.function.instruction_input(k),
                self.function.instruction_output(k),
            )  # fmt: skip
            if operation == ca.OP_OUTPUT:
                value = self.held[given[0]]
                yield f"o{result[0]}[{result[1]}] = {self._wide(value)};"
            elif operation == ca.OP_INPUT:
                alike = self.function.name_in()[given[0]] in self.shared
                yield self._value(result[0], alike, f"i{given[0]}[{given[1]}]")
            elif operation == ca.OP_CONST:
                yield self._value(result[0], True, _constant(self.function.instruction_constant(k)))
            else:
                yield from self._computed(operation, [self.held[place] for place in given], result[0])

    def _computed(self, operation: int, values: list[int], place: int) -> Iterator[str]:
        divisor = values[-1] if operation in (ca.OP_DIV, ca.OP_INV) else None
        if divisor is not None and divisor not in self.inverted:
            self.inverted.add(divisor)
            yield f"const {self._kind(self.alike[divisor])} r{divisor} = 1 / w{divisor};"
        if divisor is not None:
            text = f"r{divisor}" if operation == ca.OP_INV else f"w{values[0]} * r{divisor}"
        elif operation in _ARITHMETIC:
            text = _OPERATIONS[operation].format(*(f"w{value}" for value in values))
        else:
            yield self._value(place, False, _OPERATIONS[operation].format(*map(self._wide, values)))
            return
        yield self._value(place, all(self.alike[value] for value in values), text)

    def _value(self, place: int, alike: bool, text: str) -> str:
        self.held[place] = len(self.alike)
        self.alike.append(alike)
        return f"const {self._kind(alike)} w{self.held[place]} = {text};"

    def _wide(self, value: int) -> str:
        return f"all(w{value})" if self.alike[value] else f"w{value}"

    @staticmethod
    def _kind(alike: bool) -> str:
        return "double" if alike else "Lanes"


def _constant(value: float) -> str:
    if math.isfinite(value):
        return repr(float(value))
    return "NAN" if math.isnan(value) else "INFINITY" if value > 0 else "-INFINITY"
