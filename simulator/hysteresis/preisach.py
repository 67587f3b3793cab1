"""The classical Preisach model in its numerical form (equation 2.52-2.58)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter
from simulator.hysteresis.everett import Everett, Negative
from simulator.hysteresis.extrema import DominantExtrema
from simulator.hysteresis.reversal_curves import ReversalCurve


class Preisach:
    """f = sum of relays of weight mu(alpha, beta) (2.52), by first-order curves and dominant extrema (2.57, 2.58).

    curves : F(alpha, beta) of (2.54), half of what the output falls from the ascending branch at alpha to beta; it is
    the weight in the triangle between the two, so F(a, a) = 0; low, high : beta0 and alpha0, between which the weight
    lies: inputs beyond count as these; middle : the output halfway between both saturations. It starts in negative
    saturation, at low. Raises BadParameter unless low < high.

    >>> even = Preisach(lambda a, b: (a - b) ** 2 / 2, 0.0, 1.0)
    >>> [even.update(u) for u in (0.0, 1.0, 0.5, 1.0)]
    [-0.5, 0.5, 0.25, 0.5]
    """

    def __init__(self, curves: Callable[[float, float], float], low: float, high: float, middle: float = 0.0) -> None:
        if not low < high:
            raise BadParameter("low", f"{low:g}", f"it is not below high, {high:g}", "low is less than high")
        self._curves, self._middle = curves, middle
        self._low, self._high = low, high
        self._past = DominantExtrema(low, high)

    @classmethod
    def learned(cls, curves: Sequence[ReversalCurve], negative: Negative = "keep", noise: float = 0.0) -> Preisach:
        """The model of measured first-order curves, `Everett.learned`. Raises BadParameter as that."""
        found = Everett.learned(curves, negative, noise)
        return cls(found, float(found.levels[0]), float(found.levels[-1]), found.middle)

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value. Its time grows with the extrema remembered."""
        self._past.move(value)
        F = self._curves
        links = sum(F(top, before) - F(top, after) for top, before, after in self._past.links())
        return self._middle - F(self._high, self._low) + 2 * links

    def follow(self, path: ArrayLike) -> Array:
        """The outputs (n_samples) along a path of inputs (n_samples), one way from each to the next.

        With an `Everett` a compiled loop, whose time does not grow with the extrema remembered; otherwise as `update`.
        Raises BadParameter for a path that is not finite.
        """
        u = np.ascontiguousarray(path, dtype=float)
        if u.ndim != 1 or not np.isfinite(u).all():
            raise BadParameter("path", u.shape, "it is no row of finite inputs", "give (n_samples)")
        if not isinstance(self._curves, Everett) or not len(u):
            return np.array([self.update(float(value)) for value in u])
        from simulator.hysteresis import preisach_loop

        F, past = self._curves, self._past
        known = past.memory
        turns, sums, out = np.empty(len(known) + len(u) + 1), np.empty(len(known) + len(u) + 1), np.empty_like(u)
        turns[: len(known)], sums[0] = known, self._middle - F(self._high, self._low)
        for k in range(2, len(known), 2):
            preisach_loop.add_minimum(known[k], turns, sums, k, F.levels, F.values)
        n = preisach_loop.follow(u, out, past.now, turns, sums, len(known), F.levels, F.values)
        past.minima, past.maxima = turns[:n:2].tolist(), turns[1:n:2].tolist()
        past.now = min(max(float(u[-1]), self._low), self._high)
        return out

    @property
    def memory(self) -> tuple[float, ...]:
        """The dominant extrema, oldest first, without the value of now: all that is left of the past."""
        return self._past.memory
