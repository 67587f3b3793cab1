"""Presliding hysteresis with the two stacks of the Leuven model (equation 2.32-2.35)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter

KNOTS = 4097
"""Number of points at which the virgin curve is kept."""
REACH = 16.0
"""Where the virgin curve ends: there F is (1 - exp(-16)) of its level, and counts as the level."""


class LeuvenStack:
    """F_h = F_b + F_d(z) (2.33) of a position x, dz = dx (1 - sign(r) abs(r)^n) (2.34) with r corrected: see below.

    curve : F_d(z) [N] of an array z [m], point-symmetrical and rising, and beyond `level` somewhere or close to it;
    level : force S of steady sliding [N]; n : how late the transition bends. A reversal starts a branch of its own and
    puts the extremum on a stack; reaching the one before closes the inner loop, and the outer branch goes on.
    Start: relaxed at x = 0.

    As printed, r = F_d(z)/(S - F_b) differs between the two branches of an inner loop unless it lies evenly about
    F = 0, so others do not close: a repeated loop ratchets. Here r = F_d/S on the virgin curve, as printed, and
    F_d/(2 S) on every branch, as printed for one that starts from steady sliding, F_b = -S. Then every branch is the
    virgin curve doubled (Masing's rule), so loops close at every size; where the virgin curve is level the stacks are
    empty.
    Raises BadParameter for a level or n that is not positive, and for a curve that does not rise to the level.

    >>> stack = LeuvenStack(lambda z: 2e6 * z, level=100.0)
    >>> [round(float(f), 3) for f in stack.follow([5e-5, 2e-5, 5e-5, 1e-3])]
    [63.212, 11.376, 63.212, 100.0]
    """

    def __init__(self, curve: Callable[[Array], ArrayLike], level: float, n: float = 1.0) -> None:
        self._knots, self._values = virgin_curve(curve, level, n)
        self._state = np.zeros(5)  # x, way, force, origin of the virgin curve, number of turns
        self._turns = np.zeros((16, 2))

    @property
    def output(self) -> float:
        """The hysteresis force now [N]."""
        return float(self._state[2])

    @property
    def memory(self) -> int:
        """Number of extrema on both stacks."""
        return int(self._state[4])

    def update(self, value: float) -> float:
        """The force [N] after x moved one way to a value [m]."""
        return float(self.follow([value])[0])

    def follow(self, path: ArrayLike) -> Array:
        """The forces [N] (n_samples) along a path of x [m] (n_samples), one way from each to the next.

        Its time grows with the samples, not with the reversals. Raises BadParameter for a path that is not finite.
        """
        from simulator.hysteresis import masing

        x = np.ascontiguousarray(path, dtype=float)
        if x.ndim != 1 or not np.isfinite(x).all():
            raise BadParameter("path", x.shape, "it is no row of finite positions", "give (n_samples) in m")
        room = self.memory + len(x) + 1
        if room > len(self._turns):
            self._turns = np.vstack([self._turns[: self.memory], np.zeros((2 * room, 2))])
        out = np.empty_like(x)
        masing.follow(x, out, self._state, self._turns, self._knots, self._values)
        return out


def transition_curve(curve: Callable[[Array], ArrayLike], level: float, n: float) -> tuple[Array, Array]:
    """Knots z (n_knots) [m] and F_d (n_knots) [N] of a curve up to the level [N], close together towards it.

    Raises BadParameter for a level or n that is not positive, and for a curve that does not rise to the level.
    """
    for name, value in (("level", level), ("n", n)):
        if not 0 < value < np.inf:
            raise BadParameter(name, value, "it is not a positive number", "give more than 0")
    z = -_end(curve, level) * np.expm1(-np.linspace(0.0, REACH, KNOTS))
    force = np.asarray(curve(z), dtype=float)
    if force.shape != z.shape or abs(force[0]) > 1e-9 * level or not (np.diff(force) > 0).all():
        raise BadParameter("curve", "", "it does not rise from 0 at z = 0", "give a rising F_d(z) of an array z")
    return z, force


def virgin_curve(curve: Callable[[Array], ArrayLike], level: float, n: float) -> tuple[Array, Array]:
    """x (n_knots) [m] and F (n_knots) [N] of the solution of (2.34) from rest: x = integral of dz/(1 - (F_d/S)^n)."""
    from scipy.integrate import cumulative_simpson  # slow to import

    z, force = transition_curve(curve, level, n)
    slip = 1 - (force / level) ** n
    keep = slip > 0
    s = np.linspace(0.0, REACH, KNOTS)
    rate = z[-1] / -np.expm1(-REACH) * np.exp(-s)  # dz/ds: the integrand is smooth in s, and not in z
    x = cumulative_simpson((rate / np.where(keep, slip, 1.0))[keep], x=s[keep], initial=0.0)
    force = force[keep]
    return x, force * (level / force[-1])


def _end(curve: Callable[[Array], ArrayLike], level: float) -> float:
    """The z [m] at which the curve reaches the level, or comes within exp(-REACH) of it."""
    near = level * (1 - np.exp(-REACH))
    z = np.geomspace(1e-15, 1e6, 2101)
    over = np.flatnonzero(np.asarray(curve(z), dtype=float) >= near)
    if not len(over) or over[0] == 0:
        raise BadParameter("curve", "", f"it does not reach the level {level:g} N", "F_d(z) exceeds the level")
    low, high = z[over[0] - 1], z[over[0]]
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if np.asarray(curve(np.array([middle])))[0] >= near else (middle, high)
    return float(high)
