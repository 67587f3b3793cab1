"""A user's own constraints on parameters, as rows of the quadratic programme that makes a step.

What compares two positive parameters is linear in their logarithms, in which they are fitted: A >= f B is
log A - log B >= log f.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings import Array, BadParameter

Flags = NDArray[np.bool_]

FORM = re.compile(r"\s*([\w.]+)\s*(>=|<=)\s*(?:([0-9.eE+-]+)\s*\*\s*)?([A-Za-z_][\w.]*|[0-9.eE+-]+)\s*")
REMEDY = "write one as in lugre.fs>=1.05*lugre.fc, or mass.m<=5"


@dataclass(frozen=True)
class Constraint:
    """over >= factor * under, parameters by full name; under empty: over >= factor [SI unit]; less : <= instead."""

    over: str
    factor: float
    under: str = ""
    less: bool = False

    @classmethod
    def parse(cls, text: str) -> Constraint:
        """Read ``A>=F*B``, ``A>=B`` or ``A>=NUMBER``, or the same with ``<=``. Raises BadParameter.

        >>> Constraint.parse("lugre.fs >= 1.05*lugre.fc")
        Constraint(over='lugre.fs', factor=1.05, under='lugre.fc', less=False)
        """
        found = FORM.fullmatch(text)
        try:
            if found is None:
                raise ValueError
            over, sign, factor, other = found.groups()
            under = other if other[0].isalpha() else ""
            number = float(factor or 1.0) * (1.0 if under else float(other))
            if not np.isfinite(number):
                raise ValueError
            return cls(over, number, under, sign == "<=")
        except ValueError:
            raise BadParameter("constraints", text, "it is no constraint", REMEDY) from None

    def __str__(self) -> str:
        """The text that `parse` reads."""
        return f"{self.over}{'<=' if self.less else '>='}{self.factor!r}" + (f"*{self.under}" if self.under else "")

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that it speaks of."""
        return tuple(name for name in (self.over, self.under) if name)


def rows_of(
    constraints: Iterable[Constraint], names: tuple[str, ...], base: Array, logs: Flags, free: Flags, scale: Array
) -> tuple[Array, Array]:
    """Rows (k, n_free) and ends (k,) with rows @ theta >= ends, for parameters `names` of which some are free.

    base (n_parameters,) : values of those that are held; logs, scale : as in `Coordinates`.
    """
    place = {name: i for i, name in enumerate(names)}
    number = {name: i for i, name in enumerate(name for name, is_free in zip(names, free, strict=True) if is_free)}
    rows, ends = [], []
    for one in constraints:
        row, end, sign = np.zeros(len(number)), 0.0, -1.0 if one.less else 1.0
        logarithmic = bool(logs[place[one.over]])
        for name, side in ((one.over, 1.0), (one.under, -1.0)):
            if not name:
                continue
            i = place[name]
            if name in number:
                row[number[name]] += side * (1.0 if logarithmic else scale[i] * (one.factor if side < 0 else 1.0))
            else:
                with np.errstate(divide="ignore"):  # what is held at zero makes an end that no value reaches
                    end -= side * float(np.log(base[i]) if logarithmic else base[i] * (one.factor if side < 0 else 1.0))
        end += float(np.log(one.factor)) if logarithmic else (0.0 if one.under else one.factor)
        rows.append(sign * row)
        ends.append(sign * end)
    return np.array(rows).reshape(-1, len(number)), np.array(ends)


def checked(constraints: Iterable[str], names: tuple[str, ...], logs: Flags) -> tuple[Constraint, ...]:
    """The constraints on some parameters. Raises BadParameter for one that names others, or that is not linear in the
    coordinates of the fit.
    """
    found = tuple(Constraint.parse(text) for text in constraints)
    positive = dict(zip(names, logs, strict=True))
    for one, text in zip(found, constraints, strict=True):
        for name in one.names:
            if name not in positive:
                raise BadParameter("constraints", text, f"there is no {name}", f"there are {', '.join(names)}")
        if len({bool(positive[name]) for name in one.names}) > 1 or (positive[one.over] and one.factor <= 0):
            why = "it compares a parameter that is positive with one that need not be"
            raise BadParameter("constraints", text, why, "compare two of one kind, with a positive factor")
    return found
