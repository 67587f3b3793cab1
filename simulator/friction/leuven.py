"""The Leuven integrated friction model in time (equation 2.32-2.35)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter
from simulator.hysteresis import transition_curve


class LeuvenFriction:
    """F = F_h(z) + sigma1 dz/dt + sigma2 v (2.32), F_h = F_b + F_d(z) (2.33), dz/dt by (2.34) as `LeuvenStack` has it.

    curve : F_d(z) [N] of an array z [m], point-symmetrical and rising; level : S(v) [N] of an array v [m/s], the level
    of steady sliding without its viscous part; n : how late the transition bends; sigma1, sigma2 [N s/m]; step :
    largest move [m] taken at once, by default a fifth of what bends the curve. At steady sliding F = S(v) + sigma2 v
    (2.35). Where S(v) falls below the force of a branch, sliding has begun: the stacks are reset and the virgin curve
    goes on at the same force. Start: relaxed at rest.
    Raises BadParameter for a level, n or step that is not positive, for a negative sigma1 or sigma2, and for a curve
    that does not rise to the level.

    >>> friction = LeuvenFriction(lambda z: 1e6 * z, lambda v: 50 + 30 * np.exp(-(v / 1e-3) ** 2), sigma2=100.0)
    >>> t = np.linspace(0, 1, 101)
    >>> round(float(friction.follow(t, 0.01 * t)[-1]), 4)
    51.0
    """

    def __init__(
        self,
        curve: Callable[[Array], ArrayLike],
        level: Callable[[Array], ArrayLike],
        n: float = 1.0,
        sigma1: float = 0.0,
        sigma2: float = 0.0,
        step: float | None = None,
    ) -> None:
        for name, value, least in (("sigma1", sigma1, 0.0), ("sigma2", sigma2, 0.0)):
            if not least <= value < np.inf:
                raise BadParameter(name, value, "it is negative or not finite", "give 0 or more")
        speeds = np.concatenate([[0.0], np.geomspace(1e-9, 1e3, 400)])
        levels = self._levels(level, np.concatenate([-speeds, speeds]))
        self._level, self._n, self._sigma1, self._sigma2 = level, n, sigma1, sigma2
        self._knots, self._values = transition_curve(curve, float(levels.max()), n)
        stiffest = float((np.diff(self._values) / np.diff(self._knots)).max())
        self._step = 0.2 * float(levels.min()) / (n * stiffest) if step is None else step
        if not 0 < self._step < np.inf:
            raise BadParameter("step", self._step, "it is not a positive number", "give a length in m")
        self._state, self._turns = np.zeros(5), np.zeros((16, 2))

    @property
    def memory(self) -> int:
        """Number of extrema on both stacks."""
        return int(self._state[4])

    def follow(self, time: ArrayLike, position: ArrayLike) -> Array:
        """The friction force [N] (n_samples) against a motion: time [s], rising, and position [m], both (n_samples).

        Between samples the velocity is constant; the force is that at the end of the interval before each sample, and
        at the first sample the hysteresis force alone. Raises BadParameter for shapes that differ and for times that do
        not rise.
        """
        from simulator.hysteresis import masing

        t, x = np.ascontiguousarray(time, dtype=float), np.ascontiguousarray(position, dtype=float)
        if t.shape != x.shape or t.ndim != 1 or not len(t) or not (np.isfinite(x).all() and (np.diff(t) > 0).all()):
            raise BadParameter("time", t.shape, f"it does not rise beside positions {x.shape}", "give equal rows")
        moved, rate = np.diff(x), np.diff(x) / np.diff(t)
        room = self.memory + len(x) + 1
        if room > len(self._turns):
            self._turns = np.vstack([self._turns[: self.memory], np.zeros((2 * room, 2))])
        force, slip = np.empty(len(moved)), np.empty(len(moved))
        levels = self._levels(self._level, rate)
        start = self._state[2]
        masing.creep(
            moved, levels, self._n, self._step, force, slip, self._state, self._turns, self._knots, self._values
        )
        return np.concatenate([[start], force + self._sigma1 * slip / np.diff(t) + self._sigma2 * rate])

    @staticmethod
    def _levels(level: Callable[[Array], ArrayLike], speed: Array) -> Array:
        found = np.broadcast_to(np.asarray(level(speed), dtype=float), speed.shape)
        if not ((found > 0) & np.isfinite(found)).all():
            raise BadParameter("level", found.min(), "S(v) is not positive at every speed", "give more than 0 N")
        return np.ascontiguousarray(found)
