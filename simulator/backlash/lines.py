"""Backlash with two parallel lines (equation 2.36)."""

from __future__ import annotations

from simulator.backlash.play import GeneralisedPlay


class Backlash:
    """u = B(v) of (2.36): along m (v - cr) while v rises, along m (v - cl) while it falls, at rest in between.

    slope : m > 0; left, right : the crossings cl < cr of the v axis; start : first output.
    Raises ValueError for values that are no backlash.

    >>> gap = Backlash(left=-0.5, right=0.5)
    >>> [gap.update(v) for v in (1.0, 0.2, -1.0)]
    [0.5, 0.5, -0.5]
    """

    def __init__(self, slope: float = 1.0, left: float = -0.5, right: float = 0.5, start: float = 0.0) -> None:
        check(slope, left, right)
        self._play = GeneralisedPlay(lambda v: slope * (v - right), lambda v: slope * (v - left), start)

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value."""
        return self._play.update(value)


def check(slope: float, left: float, right: float) -> None:
    """Raises ValueError unless slope > 0 and left < right."""
    if not (slope > 0 and left < right):
        raise ValueError(f"slope {slope:g}, crossings {left:g} and {right:g}: the slope is positive, the left one less")
