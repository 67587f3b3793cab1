"""The nonlinear (input-dependent) Preisach model, of first- and second-order curves (equation 2.64-2.69)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RegularGridInterpolator

from recordings import Array, BadParameter
from simulator.hysteresis.extrema import DominantExtrema
from simulator.hysteresis.reversal_curves import check_crossing


class NonlinearPreisach:
    """f by a weight mu(alpha, beta, u) (2.64), as f_u- and the second-order increments P(alpha, beta, u) (2.66, 2.69).

    descending : the limiting descending branch f_u-; increments : P(alpha, beta, u), by which the second-order curve
    from alpha over beta lies below the first-order curve from alpha at u, beta <= u <= alpha; P(alpha, u, u) and
    P(u, beta, u) are 0. It starts in negative saturation.

    The sum (2.69) is over the strips from M_0 = alpha0 and m_0 = beta0 on; as printed it begins with k = 1, which holds
    for an input that came from positive saturation, M_1 = alpha0.
    Raises BadParameter unless low < high.
    """

    def __init__(
        self,
        descending: Callable[[float], float],
        increments: Callable[[float, float, float], float],
        low: float,
        high: float,
    ) -> None:
        if not low < high:
            raise BadParameter("low", f"{low:g}", f"it is not below high, {high:g}", "low is less than high")
        self._descending, self._increments = descending, increments
        self._past = DominantExtrema(low, high)

    @classmethod
    def learned(cls, levels: ArrayLike, first: ArrayLike, second: ArrayLike, noise: float = 0.0) -> NonlinearPreisach:
        """The model of measured curves at rising levels (n).

        first (n, n) : output at input level k on the first-order curve from level i >= k; second (n, n, n) : the same
        on the second-order curve from i down to j and up again, j <= k <= i. Others are not read. noise : standard
        deviation of the outputs, within which curves may seem to cross.
        Raises BadParameter for tables of other shapes, with a gap (a value that is not finite), and for curves that
        cross: first-order ones each other, second-order ones from one first-order curve each other or that curve.
        """
        u, f1, f2 = (np.asarray(table, dtype=float) for table in (levels, first, second))
        n = len(u)
        if u.ndim != 1 or n < 2 or not (np.diff(u) > 0).all():
            raise BadParameter("levels", u.shape, "they do not rise", "give two or more rising inputs")
        if f1.shape != (n, n) or f2.shape != (n, n, n):
            raise BadParameter("second", f2.shape, f"beside first {f1.shape}", f"give ({n}, {n}) and ({n}, {n}, {n})")
        i, j, k = np.meshgrid(*[np.arange(n)] * 3, indexing="ij")
        inside = (j <= k) & (k <= i)
        P = np.where(inside, f1[:, None, :] - f2, 0.0)
        if not np.isfinite(P).all():
            raise BadParameter("second", "", "a value is not finite", "measure every j <= k <= i: curves have no gaps")
        check_crossing(u, f1, noise)
        _check_second(u, P, 6 * noise + 1e-9 * np.abs(f1[np.tril_indices(n)]).max())
        at = RegularGridInterpolator((u, u, u), _odd(P), bounds_error=False, fill_value=None)
        return cls(
            lambda v: float(np.interp(v, u, f1[-1])), lambda a, b, v: float(at((a, b, v))), float(u[0]), float(u[-1])
        )

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value."""
        self._past.move(value)
        u, P = self._past.now, self._increments
        return self._descending(u) + sum(P(low, m, u) - P(high, m, u) for low, high, m in self._past.strips())

    @property
    def memory(self) -> tuple[float, ...]:
        """The dominant extrema, oldest first."""
        return self._past.memory


def _check_second(u: Array, P: Array, allowed: float) -> None:
    """A second-order curve from further down lies below, all of them below their first-order curve: P falls to 0."""
    i, j, k = np.meshgrid(*[np.arange(len(u))] * 3, indexing="ij")
    above = P.min(initial=0.0)
    if above < -allowed:
        raise BadParameter("second", f"{above:g}", "a second-order curve lies above its first-order one",
                           "a branch that rises lies below the one that falls")  # fmt: skip
    crossed = (np.diff(P, axis=1) > allowed) & ((j < k) & (k <= i))[:, :-1]
    if crossed.any():
        a, b, at = (int(x[0]) for x in np.nonzero(crossed))
        found = f"from {u[a]:g} over {u[b]:g} lies above that over {u[b + 1]:g} at {u[at]:g}"
        raise BadParameter(
            "second", "", f"the curve {found}", "measured curves do not cross: average, or leave one out"
        )


def _odd(P: Array) -> Array:
    """P carried on oddly beyond alpha = u and beta = u, so that it is 0 there between the levels, too."""
    n = len(P)
    i, j, k = np.meshgrid(*[np.arange(n)] * 3, indexing="ij")
    over, under = np.where(k > i, k, i), np.where(k > i, i, k)
    sign = np.where(k > i, -1.0, 1.0)
    upper, lower = np.where(j > under, under, j), np.where(j > under, j, under)
    return sign * np.where(j > under, -1.0, 1.0) * P[over, upper, np.minimum(lower, over)]


def second_order_curves(operator: Callable[[float], float], levels: ArrayLike) -> tuple[Array, Array]:
    """first (n, n) and second (n, n, n) of an operator (update) at rising levels (n), as a rig measures them."""
    u = np.asarray(levels, dtype=float)
    n = len(u)
    first, second = np.full((n, n), np.nan), np.full((n, n, n), np.nan)
    for i in range(n):
        for j in range(i + 1):
            operator(u[0])
            up = operator(u[i])
            down = [operator(u[k]) for k in range(i - 1, j - 1, -1)]
            first[i, j : i + 1] = [up, *down][::-1]
            second[i, j, j : i + 1] = [first[i, j], *(operator(u[k]) for k in range(j + 1, i + 1))]
    return first, second
