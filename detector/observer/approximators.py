"""On-line approximators, linear in the weights: y = w' S(v) with fixed regressors S, equation (4.11).

Every kind reduces to one table: base functions of the inputs, and products of their powers. One compiled function
evaluates all of them, so a new kind is a new table and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import exp
from typing import NamedTuple, Protocol

import numpy as np

from detector.arithmetic.native import native
from recordings import Array, BadInput, Integers

SIGMOID, GAUSSIAN = 0.0, 1.0
_STEEPEST = 700.0
"""exp of more is no longer a finite number; the sigmoid has reached its end long before."""


class CodedApproximator(NamedTuple):
    """An approximator as numbers. base (n_base, 7): kind and constants of base functions; powers (n_terms, n_base)."""

    base: Array
    powers: Integers


class Approximator(Protocol):
    """What the observer asks of an approximator: how many inputs it takes (1 or 2), and its table."""

    @property
    def inputs(self) -> int:
        """Number of inputs."""

    def table(self) -> CodedApproximator:
        """Base functions and powers."""


@dataclass(frozen=True)
class HighOrder:
    """High-order network: all products up to `order` of s(v_i), s(v) = m / (1 + exp(-l (v - c))) + lam, Section 4.4.

    order : highest degree; inputs : 1 or 2. Two inputs, order 2: s1, s2, s1^2, s1 s2, s2^2.

    >>> regressors(HighOrder(order=2, inputs=2, m=1.0, l=1.0, c=0.0, lam=0.0), [0.0, 0.0])
    array([0.5 , 0.5 , 0.25, 0.25, 0.25])
    """

    order: int
    inputs: int = 1
    m: float = 1.0
    l: float = 1.0  # noqa: E741  (the letter of the source)
    c: float = 0.0
    lam: float = 0.0

    def table(self) -> CodedApproximator:
        """One sigmoid an input; one row of powers a product."""
        _check_inputs(self.inputs)
        if self.order < 1:
            raise BadInput("high-order network", f"the order is {self.order}", "give 1 or more")
        base = [
            [SIGMOID, *np.eye(2)[i], self.m, self.l, self.c, self.lam]
            for i in range(self.inputs)
        ]  # fmt: skip
        terms = [t for n in range(1, self.order + 1) for t in combinations_with_replacement(range(self.inputs), n)]
        powers = [[term.count(i) for i in range(self.inputs)] for term in terms]
        return CodedApproximator(np.array(base, float), np.array(powers, np.int64))


@dataclass(frozen=True)
class RadialBasis:
    """Gaussian bells exp(-|v - centre|^2 / (2 width^2)) with fixed centres and one width.

    centres : (n_terms, n_inputs), or plain numbers for one input; width : > 0, in the unit of the inputs.

    >>> regressors(RadialBasis((0.0, 1.0), width=1.0), [1.0]).round(3)
    array([0.607, 1.   ])
    """

    centres: Sequence[float] | Sequence[Sequence[float]]
    width: float = 1.0

    @property
    def inputs(self) -> int:
        """Number of inputs: columns of the centres."""
        return _centres(self.centres).shape[1]

    def table(self) -> CodedApproximator:
        """One bell a term."""
        centres = _centres(self.centres)
        _check_inputs(self.inputs)
        if not self.width > 0:
            raise BadInput("radial basis functions", f"the width is {self.width}", "give a positive width")
        steep = np.zeros(2)
        steep[: self.inputs] = 0.5 / self.width**2
        middle = np.zeros((len(centres), 2))
        middle[:, : self.inputs] = centres
        base = np.column_stack([np.full(len(centres), GAUSSIAN), np.tile(steep, (len(centres), 1)), middle])
        return CodedApproximator(
            np.column_stack([base, np.zeros((len(centres), 2))]), np.eye(len(centres), dtype=np.int64)
        )


@dataclass(frozen=True)
class ShiftedSigmoids:
    """Sigmoids 1 / (1 + exp(-slope (v_i - centre))): every centre for every input.

    >>> regressors(ShiftedSigmoids((0.0, 1.0), slope=4.0), [1.0]).round(3)
    array([0.982, 0.5  ])
    """

    centres: Sequence[float]
    slope: float = 1.0
    inputs: int = 1

    def table(self) -> CodedApproximator:
        """One sigmoid a term."""
        _check_inputs(self.inputs)
        base = [[SIGMOID, *np.eye(2)[i], 1.0, self.slope, c, 0.0] for i in range(self.inputs) for c in self.centres]
        return CodedApproximator(np.array(base, float).reshape(-1, 7), np.eye(len(base), dtype=np.int64))


def regressors(approximator: Approximator, v: Sequence[float]) -> Array:
    """S(v) of an approximator, shape (n_terms,). v : its one or two inputs. Raises BadInput for another number."""
    if len(v) != approximator.inputs:
        raise BadInput("approximator", f"{len(v)} inputs are given", f"it takes {approximator.inputs}")
    base, powers = approximator.table()
    out = np.empty(len(powers))
    evaluate(base, powers, float(v[0]), float(v[-1]), np.empty(len(base)), out)
    return out


@native
def evaluate(base: Array, powers: Integers, first: float, second: float, values: Array, out: Array) -> None:
    """S into `out` (n_terms,); values (n_base,): room for the base functions."""
    for j in range(base.shape[0]):
        if base[j, 0] == SIGMOID:
            steep = -base[j, 4] * (base[j, 1] * first + base[j, 2] * second - base[j, 5])
            values[j] = base[j, 3] / (1.0 + exp(min(steep, _STEEPEST))) + base[j, 6]
        else:
            away = base[j, 1] * (first - base[j, 3]) ** 2 + base[j, 2] * (second - base[j, 4]) ** 2
            values[j] = exp(-away)
    for i in range(powers.shape[0]):
        product = 1.0
        for j in range(powers.shape[1]):
            for _ in range(powers[i, j]):
                product *= values[j]
        out[i] = product


def _centres(centres: Sequence[float] | Sequence[Sequence[float]]) -> Array:
    array = np.array(centres, float)
    return array.reshape(-1, 1) if array.ndim < 2 else array


def _check_inputs(inputs: int) -> None:
    if inputs not in (1, 2):
        raise BadInput("approximator", f"it has {inputs} inputs", "give 1 or 2: it is fed abs(x2), or x2 and abs(x2)")
