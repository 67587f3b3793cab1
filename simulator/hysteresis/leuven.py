"""Presliding hysteresis with the two stacks of the Leuven model (equation 2.32-2.35)."""

from __future__ import annotations

import math
from collections.abc import Callable

SLIDING = 0.999
"""Share of the level from which on the contact counts as sliding and forgets its reversals."""


class LeuvenStack:
    """F_h = F_b + F_d(z) (2.33), dz = dx (1 - sign(r) abs(r)^n), r = F_d(z)/(S - F_b) (2.34), S = level times sgn dx.

    curve : F_d(z) [N], point-symmetrical and rising; level : force of steady sliding [N]; n : how late the transition
    bends; step : largest move [m] taken at once. A reversal starts a new transition curve and puts the extremum on a
    stack; reaching the extremum before it closes the inner loop, and the outer curve goes on. Start: relaxed at x = 0.
    Raises ValueError for a level, n or step that is not positive.
    """

    def __init__(self, curve: Callable[[float], float], level: float, n: float = 1.0, step: float = 1e-6) -> None:
        if not (level > 0 and n > 0 and step > 0):
            raise ValueError(f"level {level:g}, n {n:g}, step {step:g}: all three are positive")
        self._curve, self._level, self._n, self._step = curve, level, n, step
        self._maxima: list[float] = []
        self._minima: list[float] = []
        self._input, self._base, self._z, self._way = 0.0, 0.0, 0.0, 0.0

    @property
    def output(self) -> float:
        """The hysteresis force now [N]."""
        return self._base + self._curve(self._z)

    @property
    def memory(self) -> int:
        """Number of extrema on both stacks."""
        return len(self._maxima) + len(self._minima)

    def update(self, value: float) -> float:
        """The force [N] after x moved one way to a value [m]."""
        moved = value - self._input
        if moved and self._way * moved < 0:
            self._reverse()
        self._way = moved or self._way
        parts = math.ceil(abs(moved) / self._step)
        for _ in range(parts):
            self._creep(moved / parts)
        self._input = value
        return self.output

    def _reverse(self) -> None:
        force = self.output
        (self._maxima if self._way > 0 else self._minima).append(force)
        self._base, self._z = force, 0.0

    def _creep(self, dx: float) -> None:
        half = self._z + dx / 2 * self._slip(self._z, dx)
        self._z += dx * self._slip(half, dx)
        ahead, behind = (self._maxima, self._minima) if dx > 0 else (self._minima, self._maxima)
        while ahead and behind and (self.output - ahead[-1]) * dx >= 0:
            self._close(ahead, behind)
        if self.output * math.copysign(1, dx) >= SLIDING * self._level:
            ahead.clear()
            behind.clear()

    def _slip(self, z: float, dx: float) -> float:
        r = self._curve(z) / (math.copysign(self._level, dx) - self._base)
        return 1 - math.copysign(abs(r) ** self._n, r)

    def _close(self, ahead: list[float], behind: list[float]) -> None:
        """An inner loop is closed: both its extrema go, and the curve it interrupted goes on at the same force."""
        force = self.output
        del ahead[-1], behind[-1]
        self._base = behind[-1] if behind else 0.0
        reach = self._step
        wanted = force - self._base
        while abs(self._curve(math.copysign(reach, wanted))) < abs(wanted):
            reach *= 2
        from scipy.optimize import brentq  # slow to import

        self._z = brentq(lambda z: self._curve(z) - wanted, -reach, reach)
