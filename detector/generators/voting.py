"""Physical redundancy: several measurements of one quantity, the odd one out (3.2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.generators.contract import Generator
from recordings import Array, BadInput


@dataclass(frozen=True)
class Voting(Generator):
    """(y_i - median) / deviation_i of m measurements of the same quantity.

    With two, a disagreement names nobody: both residuals are alike. From three on the largest names the sensor, as long
    as most are right. Raises BadInput for fewer than two.

    >>> Voting((1.0, 1.0, 1.0)).suspects(np.array([[0.0, 0.1, 9.0], [0.0, 0.1, 0.2]]), limit=3.0).tolist()
    [2, -1]
    """

    deviation: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.deviation) < 2:
            raise BadInput("redundancy", f"{len(self.deviation)} measurement", "voting needs two, isolation three")

    @property
    def width(self) -> tuple[int, int, int]:
        """No inputs, as many residuals as measurements."""
        return 0, len(self.deviation), len(self.deviation)

    def initial(self) -> Array:
        """Nothing to remember."""
        return np.zeros(0)

    def suspects(self, residuals: Array, limit: float) -> Array:
        """Index (n,) of the measurement that differs most, -1 where none is beyond the limit or with two only."""
        size = np.abs(residuals)
        named = np.where(size.max(axis=1) > limit, size.argmax(axis=1), -1)
        return named if len(self.deviation) > 2 else np.full(len(named), -1)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        return state, (y - np.median(y, axis=1, keepdims=True)) / np.array(self.deviation)
