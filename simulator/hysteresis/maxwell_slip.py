"""Maxwell slip: springs in parallel, each of which slips at a force of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter


class MaxwellSlip:
    """Force of elements that stick and slip: a hysteresis F_h of (2.33) with non-local memory, one state per element.

    stiffness (n_elements) [N/m]; level (n_elements) [N]: the force at which an element slips; start : first x [m], at
    which all are relaxed. Raises BadParameter for shapes that differ and for values that are not positive.

    >>> one = MaxwellSlip([2.0], [1.0])
    >>> [one.update(x) for x in (0.25, 2.0, 1.75, 0.0)]
    [0.5, 1.0, 0.5, -1.0]
    """

    def __init__(self, stiffness: ArrayLike, level: ArrayLike, start: float = 0.0) -> None:
        k, limit = np.asarray(stiffness, float), np.asarray(level, float)
        if k.shape != limit.shape or k.ndim != 1:
            raise BadParameter("level", limit.shape, f"beside a stiffness {k.shape}", "give one of each per element")
        for name, row in (("stiffness", k), ("level", limit)):
            if not ((row > 0) & np.isfinite(row)).all():
                raise BadParameter(name, row.tolist(), "an element has none that is positive", "give more than 0")
        self._stiffness, self._level = k, limit
        self._force, self._input = np.zeros_like(k), start

    def update(self, value: float) -> float:
        """The force [N] after x moved one way to a value [m]."""
        stretched = self._force + self._stiffness * (value - self._input)
        self._force, self._input = np.clip(stretched, -self._level, self._level), value
        return float(self._force.sum())

    def follow(self, path: ArrayLike) -> Array:
        """The forces [N] (n_samples) along a path of x [m] (n_samples), one way from each to the next, compiled."""
        from simulator.hysteresis import masing

        x = np.ascontiguousarray(path, dtype=float)
        moves, out = np.diff(x, prepend=self._input), np.empty_like(x)
        masing.slips(moves, self._stiffness, self._level, self._force, out)
        if len(x):
            self._input = float(x[-1])
        return out
