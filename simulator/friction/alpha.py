"""alpha(v) of the LuGre model dz/dt = v - alpha abs(v) z, and its expansions (equation 2.20-2.22, 2.27-2.31)."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter


@dataclass(frozen=True)
class StribeckAlpha:
    """alpha(v) = c0/(1 + c1 exp(-v^2/c2)) [1/m] (2.27): c0 = sigma0/fc, c1 = (fs - fc)/fc, c2 = vs^2.

    It lies between sigma0/fs and sigma0/fc where fs >= fc: the document prints the two bounds the other way round.
    Raises BadParameter for c0 or c2 that is not positive, and c1 <= -1.
    """

    c0: float
    c1: float
    c2: float

    def __post_init__(self) -> None:
        for name, value, least in (("c0", self.c0, 0.0), ("c1", self.c1, -1.0), ("c2", self.c2, 0.0)):
            if not least < value < np.inf:
                raise BadParameter(name, f"{value:g}", "it is out of range", f"more than {least:g}")

    @classmethod
    def of(cls, sigma0: float, fc: float, fs: float, vs: float) -> StribeckAlpha:
        """From LuGre's parameters [N/m, N, N, m/s], by (2.22). Raises BadParameter for one that is not positive."""
        for name, value in (("sigma0", sigma0), ("fc", fc), ("fs", fs), ("vs", vs)):
            if not 0 < value < np.inf:
                raise BadParameter(name, f"{value:g}", "it is not a positive number", "give more than 0")
        return cls(sigma0 / fc, (fs - fc) / fc, vs**2)

    def __call__(self, velocity: ArrayLike) -> Array:
        """alpha (n_samples) at velocities (n_samples) [m/s]."""
        return self.c0 / (1 + self.c1 * np.exp(-(np.asarray(velocity, dtype=float) ** 2) / self.c2))

    @property
    def converges_below(self) -> float:
        """Velocity [m/s] below which the Taylor series (2.28) converges: vs (pi^2 + ln^2 c1)^(1/4).

        alpha as a function of w = v^2 has its nearest poles where exp(-w/c2) = -1/c1, at w = c2 (ln c1 +- i pi). Beyond
        that distance no order is enough: the document's "m needs to be very large" is right up to there only.
        """
        if self.c1 == 0:
            return np.inf
        height = 0.0 if self.c1 < 0 else np.pi
        return float(np.sqrt(self.c2) * (height**2 + np.log(abs(self.c1)) ** 2) ** 0.25)


def taylor(alpha: StribeckAlpha, order: int) -> tuple[Array, Array]:
    """Weights W (order + 1) of (2.28): alpha is W @ S, S = 1, w, ..., w^order, w = (v/vs)^2; and W by powers of v^2.

    By division of power series: alpha (1 + c1 exp(-w)) = c0. Raises BadParameter for a negative order.
    """
    _check(order)
    bottom = np.array([alpha.c1 * (-1.0) ** k / factorial(k) for k in range(order + 1)])
    bottom[0] += 1
    W = np.zeros(order + 1)
    for k in range(order + 1):
        W[k] = ((alpha.c0 if k == 0 else 0.0) - bottom[1 : k + 1] @ W[:k][::-1]) / bottom[0]
    return W, W / alpha.c2 ** np.arange(order + 1)


def taylor_value(alpha: StribeckAlpha, order: int, velocity: ArrayLike) -> Array:
    """The expansion (2.28) at velocities (n_samples) [m/s]."""
    w = np.asarray(velocity, dtype=float) ** 2 / alpha.c2
    return np.asarray(np.polynomial.polynomial.polyval(w, taylor(alpha, order)[0]), dtype=float)


def functional_basis(nominal: float, c2: float, order: int, velocity: ArrayLike) -> Array:
    """S (n_samples, order + 1) of (2.30): exp(-k v^2/c2)/(1 + c1n exp(-v^2/c2))^(k + 1).

    Raises BadParameter for a negative order, nominal <= -1 and c2 that is not positive.
    """
    _check(order)
    if not nominal > -1:
        raise BadParameter("nominal", f"{nominal:g}", "alpha has a pole", "c1n is more than -1")
    if not 0 < c2 < np.inf:
        raise BadParameter("c2", f"{c2:g}", "it is not a positive number", "give vs^2")
    e = np.exp(-(np.atleast_1d(np.asarray(velocity, dtype=float)) ** 2) / c2)
    k = np.arange(order + 1)
    return e[:, None] ** k / (1 + nominal * e[:, None]) ** (k + 1)


def functional(alpha: StribeckAlpha, nominal: float, order: int) -> Array:
    """Weights W (order + 1) of (2.29): c0 (-1)^k (c1 - c1n)^k. (2.29) as printed lacks the 1/k! that (2.30) has."""
    _check(order)
    weights: Array = alpha.c0 * (nominal - alpha.c1) ** np.arange(order + 1, dtype=float)
    return weights


def functional_remainder(alpha: StribeckAlpha, nominal: float, order: int, velocity: ArrayLike) -> Array:
    """What (2.29) leaves (n_samples), exactly: c0 (-(c1 - c1n) e)^(m+1) / ((1 + c1n e)^(m+1) (1 + c1 e)).

    The geometric series gives it in closed form; the printed (2.31) has an unknown point xi instead and one power of
    its denominator too few.
    """
    e = np.exp(-(np.asarray(velocity, dtype=float) ** 2) / alpha.c2)
    ratio = -(alpha.c1 - nominal) * e / (1 + nominal * e)
    return alpha.c0 * ratio ** (order + 1) / (1 + alpha.c1 * e)


def functional_both_basis(nominal: tuple[float, float], order: int, velocity: ArrayLike) -> Array:
    """S (n_samples, 1 + order (order + 1)) of the expansion in c1 and c2: v^2i e^k/(1 + c1n e)^(k + 1).

    nominal : c1n and c2n; e = exp(-v^2/c2n). First i = k = 0, then for each k from 1 to the order all i from 0 to the
    order. Raises BadParameter as `functional_basis`.
    """
    c1n, c2n = nominal
    plain = functional_basis(c1n, c2n, order, velocity)
    w = np.atleast_1d(np.asarray(velocity, dtype=float)) ** 2
    powers = w[:, None] ** np.arange(order + 1)
    return np.column_stack([plain[:, :1], *(plain[:, [k]] * powers for k in range(1, order + 1))])


def functional_both(alpha: StribeckAlpha, nominal: tuple[float, float], order: int) -> Array:
    """Weights W (1 + order (order + 1)) of that expansion, by the Taylor series in c1 - c1n and 1/c2n - 1/c2.

    With w = v^2, e = exp(-w/c2n), d = c1 - c1n and h = 1/c2n - 1/c2 the denominator is 1 + c1n e + e u, where
    u = d + (c1n + d)(exp(h w) - 1). So alpha is c0 times the sum over k of (-u e)^k/(1 + c1n e)^(k + 1), and what is
    left of u^k up to the order in d and h together is a polynomial in w.
    """
    _check(order)
    c1n, c2n = nominal
    d, h = alpha.c1 - c1n, 1 / c2n - 1 / alpha.c2
    series = np.array([0.0, *(1 / factorial(i) for i in range(1, order + 1))])
    u = np.zeros((order + 1, order + 1))  # by powers of d and of h w
    u[0] = c1n * series
    if order:
        u[1] = series
        u[1, 0] = 1.0
    power, rows = np.zeros_like(u), []
    power[0, 0] = 1.0
    inside = np.add.outer(np.arange(order + 1), np.arange(order + 1)) <= order
    for k in range(order + 1):
        weights = (-1.0) ** k * alpha.c0 * (d ** np.arange(order + 1.0) @ power) * h ** np.arange(order + 1.0)
        rows.append(weights[:1] if k == 0 else weights)
        power = np.where(inside, _product(power, u), 0.0)
    return np.concatenate(rows)


def _product(one: Array, other: Array) -> Array:
    """Of two polynomials in two variables (n, n), without the powers from n on."""
    n, found = len(one), np.zeros_like(one)
    for a in range(n):
        for i in range(n):
            found[a:, i:] += one[a, i] * other[: n - a, : n - i]
    return found


def _check(order: int) -> None:
    if order < 0:
        raise BadParameter("order", order, "it is negative", "0 or more")
