"""Signals computed from columns: a sum of terms, each a product of numbers, constants and at most one column.

    gtau * vir                                      a column times a constant of the file
    force[N] - diaphragm_area_m2 * pressure[bar]    columns with units are taken in SI
    6.25 * #3 - 25                                  the third column, scaled and shifted

Only sums of products are understood; nothing is evaluated as code.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.importers.table import ForeignTable
from recordings.units import convert, unit

_TOKEN = re.compile(
    r"""\s*(?:
    (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
  | (?P<column>\#\d+|"[^"]+"|'[^']+')
  | (?P<name>[^\W\d][\w.]*)
  | \[(?P<unit>[^\]]+)\]
  | (?P<sign>[-+*])
    )\s*""",
    re.VERBOSE,
)
_END = ("end", "")
_REMEDY = "a formula is a sum of gain * column[unit], such as: force[N] - 4.9e-4 * pressure[bar]"

Token = tuple[str, str]


@dataclass(frozen=True)
class Factor:
    """One factor of a term: the column or constant `name`, in `unit` if one is given, else the number `value`."""

    name: str | None = None
    value: float = 1.0
    unit: str | None = None


Product = tuple[Factor, ...]


def parse(text: str, where: str = "formula") -> tuple[Product, ...]:
    """The terms of a formula; a minus sign is a factor -1. Raises `BadInput` saying where it is not understood.

    >>> parse("2 * x[mm] - y")[1]
    (Factor(name=None, value=-1.0, unit=None), Factor(name='y', value=1.0, unit=None))
    """
    tokens, terms = deque([*_tokens(text, where), _END]), list[Product]()
    while not terms or tokens[0] != _END:
        terms.append(_term(tokens, text, where))
    return tuple(terms)


def evaluate(text: str, target: str, table: ForeignTable, constants: Mapping[str, float], where: str) -> Array:
    """The values of a formula in the unit `target`, shape (n_rows,).

    Columns with a unit are taken in SI, and the sum is then converted to `target`; without any unit in the formula the
    sum is taken as it is. A name is a column before it is one of `constants`.

    Raises
    ------
    BadInput
        The formula is not understood, a name is neither a column nor a constant, or a term has not one column or none.
    """
    terms = parse(text, where)
    columns = {name for name in names_in(text, where) if table.find(name) or name not in constants}
    if not columns:
        raise BadInput(where, f"'{text}' has no column", _REMEDY)
    values = {name: table.numbers(name) for name in columns}
    total = np.zeros(len(next(iter(values.values()))))
    with np.errstate(over="ignore", invalid="ignore"):
        for term in terms:
            total = total + _product(term, values, constants, f"{where}: '{text}'")
    if any(factor.unit for term in terms for factor in term):
        total = convert(total, unit(target, where).si, target, where)
    return total


def names_in(text: str, where: str = "formula") -> set[str]:
    """The columns and constants that a formula names."""
    return {factor.name for term in parse(text, where) for factor in term if factor.name}


def _product(term: Product, columns: Mapping[str, Array], constants: Mapping[str, float], where: str) -> Array | float:
    gain, values = 1.0, None
    for factor in term:
        if factor.name is None:
            gain *= factor.value
        elif factor.name not in columns:
            gain *= constants[factor.name]
        elif values is None:
            column = columns[factor.name]
            values = unit(factor.unit, where).to_si(column) if factor.unit else column
        else:
            raise BadInput(where, "two columns are multiplied", _REMEDY)
    return gain if values is None else gain * values


def _tokens(text: str, where: str) -> list[Token]:
    tokens, place = list[Token](), 0
    while place < len(text):
        match = _TOKEN.match(text, place)
        if not match or not match.lastgroup:
            raise BadInput(where, f"'{text}' is not understood from '{text[place:]}' on", _REMEDY)
        tokens.append((match.lastgroup, match[match.lastgroup]))
        place = match.end()
    return tokens


def _term(tokens: deque[Token], text: str, where: str) -> Product:
    factors = list[Factor]()
    while tokens[0] in {("sign", "+"), ("sign", "-")}:
        if tokens.popleft()[1] == "-":
            factors.append(Factor(value=-1.0))
    factors.append(_factor(tokens, text, where))
    while tokens[0] == ("sign", "*"):
        tokens.popleft()
        factors.append(_factor(tokens, text, where))
    if tokens[0][0] not in {"sign", "end"}:
        raise BadInput(where, f"'{text}' is not understood at '{tokens[0][1]}'", _REMEDY)
    return tuple(factors)


def _factor(tokens: deque[Token], text: str, where: str) -> Factor:
    kind, word = tokens.popleft()
    if kind == "number":
        return Factor(value=float(word))
    if kind in {"name", "column"}:
        symbol = tokens.popleft()[1] if tokens[0][0] == "unit" else None
        return Factor(word.strip("\"'").removeprefix("#"), unit=symbol)
    raise BadInput(where, f"'{text}' is not understood at '{word}'" if word else f"'{text}' ends too early", _REMEDY)
