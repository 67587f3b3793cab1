"""Limit checking: every measurement against preset limits (3.2.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from detector.generators.contract import EvaluatedGenerator, Generator
from recordings import Array, BadInput


@dataclass(frozen=True)
class Limits(Generator):
    """(y - middle) / half the width of its limits: beyond 1 or -1 it is outside.

    >>> checked = Limits((0.0,), (10.0,))
    >>> checked.run(checked.initial(), np.zeros((2, 0)), [[5.0], [11.0]])[1].ravel().tolist()
    [0.0, 1.2]
    """

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    @property
    def width(self) -> tuple[int, int, int]:
        """No inputs, as many residuals as outputs."""
        return 0, len(self.lower), len(self.lower)

    def initial(self) -> Array:
        """Nothing to remember."""
        return np.zeros(0)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        lower, upper = np.array(self.lower), np.array(self.upper)
        return state, (2 * y - upper - lower) / (upper - lower)


def learn_limits(y: Array, margin: float = 0.0) -> Limits:
    """Limits (m,) that hold fault-free measurements (n, m), widened by a share of their range. Raises BadInput."""
    lower, upper = np.nanmin(y, axis=0), np.nanmax(y, axis=0)
    if not (np.isfinite(lower).all() and (upper > lower).all()):
        raise BadInput("limits", "a measurement does not vary or is missing", "give its limits by hand")
    room = margin * (upper - lower)
    return Limits(tuple((lower - room).tolist()), tuple((upper + room).tolist()))


def _checked(run: Mapping[str, Array]) -> Array:
    return np.column_stack([run["P1"], run["P2"], run["T1"], run["X"], run["F"], run["X"] - run["CV"]])


EVALUATED = EvaluatedGenerator("limits", "limit checking of the measurements", _checked, learn_limits)
