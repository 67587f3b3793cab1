"""A trouble that comes again and again, told twice: when it begins, and with its count when it is over."""

from __future__ import annotations

from dataclasses import dataclass

QUIET_S = 30.0
"""A trouble is over when it has not come again for so long [s]: one that comes and goes must not fill the disk."""


@dataclass
class Episode:
    """It began at `began` [s], came last at `last` [s], and `n` of what it counts belong to it, `told` of them said.

    >>> late = Episode.begin(10.0, 2)
    >>> late.again(35.0, 5)
    >>> late.over(64.0), late.over(66.0), late.n, late.more, late.lasted_s
    (False, True, 7, True, 25.0)
    """

    began: float
    last: float
    n: int
    told: int

    @classmethod
    def begin(cls, now: float, n: int = 1) -> Episode:
        """It comes for the first time [s], so many at once, and that is told."""
        return cls(now, now, n, n)

    def again(self, now: float, n: int = 1) -> None:
        """It comes again, at a time [s]."""
        self.last, self.n = now, self.n + n

    def over(self, now: float, quiet_s: float = QUIET_S) -> bool:
        """Whether it has not come for so long [s]."""
        return now - self.last >= quiet_s

    @property
    def more(self) -> bool:
        """Whether more came than was told at the beginning."""
        return self.n > self.told

    @property
    def lasted_s(self) -> float:
        """From the first to the last time it came [s]."""
        return self.last - self.began
