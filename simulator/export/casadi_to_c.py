"""CasADi scalar functions as C that can be read: named quantities, and expressions instead of one operation a line.

Every operation means what it means in the C that CasADi itself generates, in the same order, so the numbers are the
same. CasADi's own text is not used because its work vectors and argument pointers hide the physics.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import casadi as ca

LONG = 72
"""Length of an expression from which it gets a name of its own."""

LOOSE, SUM, PRODUCT, ATOM = range(4)
"""How tightly a text binds."""

OPERATORS = {
    "ADD": ("+", SUM), "SUB": ("-", SUM), "MUL": ("*", PRODUCT), "DIV": ("/", PRODUCT),
    "LT": ("<", LOOSE), "LE": ("<=", LOOSE), "EQ": ("==", LOOSE), "NE": ("!=", LOOSE), "AND": ("&&", LOOSE),
    "OR": ("||", LOOSE),
}  # fmt: skip
CALLS = {
    name: name.lower()
    for name in (
        "EXP", "LOG", "SQRT", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "SINH", "COSH", "TANH", "ASINH", "ACOSH",
        "ATANH", "EXPM1", "LOG1P", "ERF", "FABS", "FLOOR", "CEIL", "POW", "ATAN2", "HYPOT", "REMAINDER", "COPYSIGN",
        "FMIN", "FMAX", "FMOD",
    )
} | {"CONSTPOW": "pow", "SIGN": "sign_of"}  # fmt: skip
OTHERS = {
    "NEG": ("-{0}", PRODUCT), "SQ": ("{0} * {0}", PRODUCT), "TWICE": ("2.0 * {0}", PRODUCT),
    "INV": ("1.0 / {0}", PRODUCT), "NOT": ("!{0}", PRODUCT), "IF_ELSE_ZERO": ("({0} ? {1} : 0.0)", ATOM),
}  # fmt: skip
"""Operations with a form of their own; their operands stand as atoms."""

_NAMES = {getattr(ca, name): name.removeprefix("OP_") for name in dir(ca) if name.startswith("OP_")}


class _Text(NamedTuple):
    """An expression, and how tightly it binds."""

    text: str
    binds: int

    def within(self, least: int) -> str:
        """The text, in brackets where it binds less than is needed."""
        return self.text if self.binds >= least else f"({self.text})"


def c_statements(function: ca.Function, inputs: Sequence[Sequence[str]], outputs: Sequence[Sequence[str]]) -> list[str]:
    """The statements of a C function that computes what an SX function with dense outputs computes.

    inputs : for each input of the function, how its elements are called in C; outputs : what each element of each
    output is assigned to, as text in front of `` = ``, for example ``next->x``; it must not be one of the inputs.
    Raises NotImplementedError for an operation that has no translation, ValueError for a free symbol.

    >>> x, y = ca.SX.sym("x"), ca.SX.sym("y")
    >>> c_statements(ca.Function("f", [x, y], [x - (x + y) * 2]), [["s->x"], ["u"]], [["*r"]])
    ['*r = s->x - 2.0 * (s->x + u);']
    """
    if function.has_free():
        raise ValueError(f"{function.name()}: the symbols {function.free_sx()} are neither states nor parameters")
    return list(_statements(function, _uses(function), inputs, outputs))


def _uses(function: ca.Function) -> list[int]:
    """How often the result of each instruction is used; an operation that names its operand twice counts twice."""
    last: dict[int, int] = {}
    count: Counter[int] = Counter()
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        if operation not in (ca.OP_INPUT, ca.OP_CONST):
            for place in function.instruction_input(k):
                count[last[place]] += 2 if operation == ca.OP_SQ else 1
        if operation != ca.OP_OUTPUT:
            last[function.instruction_output(k)[0]] = k
    return [count[k] for k in range(function.n_instructions())]


def _statements(
    function: ca.Function, uses: Sequence[int], inputs: Sequence[Sequence[str]], outputs: Sequence[Sequence[str]]
) -> Iterator[str]:
    held: dict[int, _Text] = {}
    named = 0
    for k in range(function.n_instructions()):
        operation, given, result = (
            function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        )  # fmt: skip
        if operation == ca.OP_OUTPUT:
            yield f"{outputs[result[0]][result[1]]} = {held[given[0]].text};"
        elif operation == ca.OP_INPUT:
            held[result[0]] = _Text(inputs[given[0]][given[1]], ATOM)
        elif operation == ca.OP_CONST:
            held[result[0]] = constant(function.instruction_constant(k))
        else:
            made = _made(function.name(), operation, [held[place] for place in given])
            if uses[k] > 1 or len(made.text) > LONG:
                named += 1
                yield f"const double a{named} = {made.text};"
                made = _Text(f"a{named}", ATOM)
            held[result[0]] = made


def _made(where: str, operation: int, given: Sequence[_Text]) -> _Text:
    """The text of an operation on texts."""
    name = _NAMES.get(operation, str(operation))
    if name == "ASSIGN":
        return given[0]
    if name in OPERATORS:
        sign, binds = OPERATORS[name]
        left = given[0].within(ATOM if binds == LOOSE else binds)
        return _Text(f"{left} {sign} {given[1].within(ATOM if binds == LOOSE else binds + 1)}", binds)
    if name in CALLS:
        return _Text(f"{CALLS[name]}({', '.join(one.text for one in given)})", ATOM)
    if name in OTHERS:
        form, binds = OTHERS[name]
        return _Text(form.format(*(one.within(ATOM) for one in given)), binds)
    raise NotImplementedError(f"{where}: the operation {name} has no translation to C")


def constant(value: float) -> _Text:
    """A number as C source: the shortest text that gives it back."""
    if math.isnan(value):
        return _Text("NAN", ATOM)
    text = repr(abs(float(value))) if math.isfinite(value) else "INFINITY"
    return _Text(f"-{text}", PRODUCT) if math.copysign(1.0, value) < 0 else _Text(text, ATOM)
