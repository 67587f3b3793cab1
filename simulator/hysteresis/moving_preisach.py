"""The moving Preisach model: saturation as measured, not flat (equation 2.59-2.63)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from recordings import Array, BadParameter
from simulator.hysteresis.extrema import DominantExtrema
from simulator.hysteresis.reversal_curves import ReversalCurve, tabulated

Branch = Callable[[float], float]


class MovingPreisach:
    """f = integral of mu gamma over the rectangle R_u + (f_u+ + f_u-)/2 (2.59), by the sum (2.63).

    ascending, descending : the limiting branches f_u+ and f_u- at any input, also beyond low and high, where both are
    one; curves : T(alpha, beta) of (2.60), by which the first-order curve from alpha lies below the descending branch
    at beta. It starts in negative saturation.

    The printed (2.63) has a factor 2 before its sum. T is twice the weight between alpha, alpha0, beta0 and beta
    already, so it is 1: f = f_u+ + sum of [T(M_k+1, m_k) - T(M_k, m_k)], the last M being the input.
    Raises BadParameter unless low < high.
    """

    def __init__(
        self, ascending: Branch, descending: Branch, curves: Callable[[float, float], float], low: float, high: float
    ) -> None:
        if not low < high:
            raise BadParameter("low", f"{low:g}", f"it is not below high, {high:g}", "low is less than high")
        self._ascending, self._descending, self._curves = ascending, descending, curves
        self._low, self._high = low, high
        self._past = DominantExtrema(low, high)

    @classmethod
    def learned(
        cls,
        curves: Sequence[ReversalCurve],
        below: Branch | None = None,
        above: Branch | None = None,
        noise: float = 0.0,
    ) -> MovingPreisach:
        """The model of measured first-order curves: T by (2.60), its branches by their ends and by the highest curve.

        below, above : the output beyond the lowest and the highest reversal value; flat where not given; noise :
        standard deviation of the outputs, within which curves may seem to cross.
        Raises BadParameter for curves with gaps and for crossing curves.
        """
        levels, outputs = tabulated(curves, noise)
        n, up, down = len(levels), np.diag(outputs).copy(), outputs[-1]
        table = np.tril(down[None, :] - outputs)

        def branch(values: Array) -> Branch:
            def at(u: float) -> float:
                if u < levels[0] and below:
                    return below(u)
                if u > levels[-1] and above:
                    return above(u)
                return float(np.interp(u, levels, values))

            return at

        def T(alpha: float, beta: float) -> float:
            i = min(max(int(np.searchsorted(levels, alpha)) - 1, 0), n - 2)
            j = min(max(int(np.searchsorted(levels, beta, side="right")) - 1, 0), n - 2)
            a = (alpha - levels[i]) / (levels[i + 1] - levels[i])
            b = (beta - levels[j]) / (levels[j + 1] - levels[j])
            corner = table[i : i + 2, j : j + 2]
            if i == j:  # the triangle that the line alpha = beta cuts off
                (start, _), (foot, end) = corner
                return float(start + a * (foot - start) + b * (end - foot))
            return float(np.array([1 - a, a]) @ corner @ np.array([1 - b, b]))

        return cls(branch(up), branch(down), T, float(levels[0]), float(levels[-1]))

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value."""
        self._past.move(value)
        if not self._low <= value <= self._high:
            return self._ascending(value) if value < self._low else self._descending(value)
        u, T = self._past.now, self._curves
        if not self._past.falling:
            return self._ascending(u) + sum(T(low, m) - T(high, m) for low, high, m in self._past.strips())
        # The last strip ends at T(u, u) = f_u- - f_u+.
        *inner, (_, top, m) = self._past.strips()
        whole = self._descending(u) - T(top, m)
        return whole + sum(T(low, m) - T(high, m) for low, high, m in inner)

    @property
    def memory(self) -> tuple[float, ...]:
        """The dominant extrema, oldest first."""
        return self._past.memory
