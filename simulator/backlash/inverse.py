"""The inverse of a backlash (equation 2.37)."""

from __future__ import annotations

from simulator.backlash.lines import check


class BacklashInverse:
    """v = BI(ud) of (2.37), which makes B(v) = ud: it crosses the gap at once when ud turns.

    slope, left, right : as of the backlash; start : the first ud and v. It inverts from the first turn on, and before
    that where the backlash started on the line that v lies on.

    >>> inverse = BacklashInverse(left=-0.5, right=0.5)
    >>> [inverse.update(ud) for ud in (1.0, 1.0, 0.9)]
    [1.5, 1.5, 0.4]
    """

    def __init__(
        self, slope: float = 1.0, left: float = -0.5, right: float = 0.5, start: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        check(slope, left, right)
        self._slope, self._left, self._right = slope, left, right
        self._wanted, self.output = start

    def update(self, value: float) -> float:
        """The input that the backlash needs for its output to move one way to a value."""
        if value != self._wanted:
            self.output = value / self._slope + (self._right if value > self._wanted else self._left)
            self._wanted = value
        return self.output
